"""Records of small worlds for the tests of the simulation."""

from __future__ import annotations

import math

from minirospy.core.sdf.model import (
    IDENTITY,
    Axis,
    Box,
    Collision,
    Cylinder,
    Geometry,
    Inertial,
    Joint,
    Link,
    Model,
    Plane,
    Pose,
    Sphere,
    Surface,
    Vector,
)

SURFACE = Surface()
AXIS = Axis()
GROUND = Model(
    "ground",
    {"link": Link("link", collisions=(Collision("plane", Plane(), surface=Surface(100.0, 50.0)),))},
    is_static=True,
)


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> Pose:
    """Return a pose."""
    return Pose((x, y, z), (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)))


def solid(mass: float, geometry: Geometry) -> Inertial:
    """Return the inertia of a solid box, cylinder or sphere, or a default."""
    if isinstance(geometry, Box):
        x, y, z = (side * side for side in geometry.size)
        return Inertial(
            mass, IDENTITY, (mass * (y + z) / 12, 0, 0, mass * (x + z) / 12, 0, mass * (x + y) / 12)
        )
    if isinstance(geometry, Cylinder):
        side = mass * (3 * geometry.radius**2 + geometry.length**2) / 12
        return Inertial(mass, IDENTITY, (side, 0, 0, side, 0, mass * geometry.radius**2 / 2))
    if not isinstance(geometry, Sphere):
        return Inertial()
    value = 0.4 * mass * geometry.radius**2
    return Inertial(mass, IDENTITY, (value, 0, 0, value, 0, value))


def body(
    name: str, geometry: Geometry, mass: float = 1.0, pose: Pose = IDENTITY, surface: Surface = SURFACE
) -> Link:
    """Return a link of one solid shape."""
    return Link(name, pose, solid(mass, geometry), (Collision("shape", geometry, surface=surface),))


def single(name: str, geometry: Geometry, mass: float = 1.0, pose: Pose = IDENTITY, mu: float = 1.0) -> Model:
    """Return a model of one solid shape."""
    return Model(name, {"link": body("link", geometry, mass, surface=Surface(mu, mu))}, pose=pose)


def still(name: str, geometry: Geometry, pose: Pose = IDENTITY, mu: float = 1.0) -> Model:
    """Return a static model."""
    return Model(name, {"link": body("link", geometry, surface=Surface(mu, mu))}, pose=pose, is_static=True)


def pendulum(count: int = 1, length: float = 0.5, start: float = 0.1, axis: Axis = AXIS) -> Model:
    """Return rods that hang from the world, without shapes; each turns about its upper end's y axis."""
    links: dict[str, Link] = {}
    joints: dict[str, Joint] = {}
    parent = "world"
    for index in range(count):
        name = f"rod{index}"
        inertia = length**2 / 12
        inertial = Inertial(1.0, Pose((0, 0, -length / 2)), (inertia, 0, 0, inertia, 0, 1e-4))
        links[name] = Link(name, Pose((0, 0, 2 - index * length)), inertial)
        joints[f"joint{index}"] = Joint(
            f"joint{index}",
            "continuous",
            parent,
            name,
            axis=axis._replace(xyz=(0, 1, 0), initial_position=start),
        )
        parent = name
    return Model("pendulum", links, joints)


def diff_drive(name: str = "robot", pose: Pose = IDENTITY) -> Model:
    """Return a robot: two wheels with radius 0.05 at y = +-0.15, and a smooth caster in front and behind."""
    wheel = Cylinder(0.05, 0.03)
    half = math.sqrt(0.5)
    turned = (-half, 0.0, 0.0, half)  # z of the cylinder to y
    links = {"base": body("base", Box((0.3, 0.24, 0.06)), 4.0, at(z=0.08))}
    joints: dict[str, Joint] = {}
    for side, y in (("left", 0.15), ("right", -0.15)):
        links[side] = body(side, wheel, 0.3, Pose((0, y, 0.05), turned), Surface(10.0, 10.0))
        axis = Axis((0.0, 0.0, 1.0))
        joints[f"{side}_joint"] = Joint(f"{side}_joint", "continuous", "base", side, axis=axis)
    for side, x in (("front", 0.12), ("back", -0.12)):
        links[side] = body(side, Sphere(0.025), 0.1, at(x=x, z=0.025), Surface(0.0, 0.0))
        joints[side] = Joint(side, "fixed", "base", side)
    return Model(name, links, joints, pose=pose)


def four_wheels(length: float = 0.3, width: float = 0.33, radius: float = 0.0625, mass: float = 4.5) -> Model:
    """Return a robot with wheels at (+-length/2, +-width/2) that do not steer; ``joint0`` and ``joint1`` are on the left."""
    half = math.sqrt(0.5)
    links = {"base": body("base", Box((0.3, 0.25, 0.1)), mass, at(z=0.1))}
    joints: dict[str, Joint] = {}
    for index, (x, y) in enumerate([(1, 1), (-1, 1), (1, -1), (-1, -1)]):
        place = Pose((x * length / 2, y * width / 2, radius), (-half, 0.0, 0.0, half))
        links[f"wheel{index}"] = body(f"wheel{index}", Cylinder(radius, 0.04), 0.28, place)
        axis = Axis((0.0, 0.0, 1.0))
        joints[f"joint{index}"] = Joint(f"joint{index}", "continuous", "base", f"wheel{index}", axis=axis)
    return Model("robot", links, joints)


def arm(count: int = 7, base: Vector = (0.0, 0.0, 0.0)) -> Model:
    """Return an arm on the ground with links of 0.2 m, whose axes are z, y, z, y, ..."""
    links = {"base": body("base", Box((0.2, 0.2, 0.1)), 5.0, at(*base[:2], base[2] + 0.05))}
    joints = {"fixed": Joint("fixed", "fixed", "world", "base")}
    parent = "base"
    for index in range(count):
        name = f"link{index}"
        shape = Box((0.05, 0.05, 0.18))
        inertia = solid(1.5, shape)._replace(pose=at(z=0.1))
        collision = Collision("shape", shape, at(z=0.1))
        links[name] = Link(name, at(*base[:2], base[2] + 0.1 + 0.2 * index), inertia, (collision,))
        axis = Axis((0, 0, 1) if index % 2 == 0 else (0, 1, 0), -2.5, 2.5, effort=200.0, damping=0.1)
        joints[f"joint{index}"] = Joint(f"joint{index}", "revolute", parent, name, axis=axis)
        parent = name
    return Model("arm", links, joints)
