"""The parts of a simulated world, as frozen records that both the SDF and the URDF reader produce.

Lengths are in metres, angles in radians, masses in kilograms, times in seconds. Poses are relative to the parent: a model's pose
to the world, a link's to its model, a joint's to its child link, all others to their link. Nested models are flattened, with
their links and joints named ``nested::link``. Source: http://sdformat.org/spec.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from minirospy.core.urdf.elements import Element

__all__ = [
    "IDENTITY",
    "MIN_STEP",
    "Axis",
    "Box",
    "Collision",
    "Color",
    "Cylinder",
    "Geometry",
    "Heightmap",
    "Inertial",
    "Joint",
    "Light",
    "Link",
    "Material",
    "MeshShape",
    "Mimic",
    "Model",
    "Physics",
    "Plane",
    "Plugin",
    "Polyline",
    "Pose",
    "Quaternion",
    "Sensor",
    "Sphere",
    "Surface",
    "Vector",
    "Visual",
    "World",
]

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]  # x, y, z, w
Color = tuple[float, float, float, float]  # red, green, blue, opacity, each from 0 to 1


class Pose(NamedTuple):
    """A position and an orientation (x, y, z, w) in the parent's frame."""

    position: Vector = (0.0, 0.0, 0.0)
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)


IDENTITY = Pose()
MIN_STEP = 1e-9  # s; shorter steps are impossible, because time is counted in whole nanoseconds


class Box(NamedTuple):
    """A box, defined by its side lengths."""

    size: Vector


class Cylinder(NamedTuple):
    """A cylinder along z."""

    radius: float
    length: float


class Sphere(NamedTuple):
    """A sphere."""

    radius: float


class Plane(NamedTuple):
    """A plane through the origin. ``size``: the visible part; a ground's collisions are infinite."""

    normal: Vector = (0.0, 0.0, 1.0)
    size: tuple[float, float] = (1.0, 1.0)


class MeshShape(NamedTuple):
    """A mesh: the path of an existing file, and the name of the sub-mesh (empty: the whole mesh)."""

    path: str
    scale: Vector = (1.0, 1.0, 1.0)
    submesh: str = ""
    is_centered: bool = False


class Heightmap(NamedTuple):
    """A terrain: a square greyscale image with 2^n + 1 pixels per side, the terrain's size, and the position of its centre."""

    path: str
    size: Vector = (1.0, 1.0, 1.0)
    position: Vector = (0.0, 0.0, 0.0)


class Polyline(NamedTuple):
    """A prism over a polygon."""

    points: tuple[tuple[float, float], ...]
    height: float


Geometry = Box | Cylinder | Sphere | Plane | MeshShape | Heightmap | Polyline


class Material(NamedTuple):
    """The appearance of a visual. ``script``: the material's name, such as ``Gazebo/Grey``, whose colour is in ``color``."""

    color: Color | None = None
    script: str = ""
    texture: str = ""  # the path of an image file
    emissive: Color | None = None


class Surface(NamedTuple):
    """Friction and contact parameters. The defaults are ODE's."""

    mu: float = 1.0
    mu2: float = 1.0
    kp: float = 1e12  # N/m
    kd: float = 1.0  # N s/m
    min_depth: float = 0.0
    max_velocity: float = 0.01
    restitution: float = 0.0
    fdir1: Vector = (0.0, 0.0, 0.0)


_SURFACE = Surface()
_MATERIAL = Material()


@dataclass(frozen=True)
class Collision:
    """A shape for contacts."""

    name: str
    geometry: Geometry
    pose: Pose = IDENTITY
    surface: Surface = _SURFACE


@dataclass(frozen=True)
class Visual:
    """A visible shape."""

    name: str
    geometry: Geometry
    pose: Pose = IDENTITY
    material: Material = _MATERIAL
    transparency: float = 0.0


class Inertial(NamedTuple):
    """A link's mass, the pose of its centre of mass, and its inertia there: ixx, ixy, ixz, iyy, iyz, izz."""

    mass: float = 1.0
    pose: Pose = IDENTITY
    inertia: tuple[float, float, float, float, float, float] = (1.0, 0.0, 0.0, 1.0, 0.0, 1.0)


_INERTIAL = Inertial()


@dataclass(frozen=True)
class Plugin:
    """A plugin: the library's file name without ``lib`` and ``.so``, and the element with its parameters."""

    name: str
    library: str
    element: Element


@dataclass(frozen=True)
class Sensor:
    """A sensor. ``kind`` is SDF's sensor type: ``ray``, ``gpu_ray``, ``camera``, ``depth``, ``imu``, ``contact``, ..."""

    name: str
    kind: str
    element: Element
    pose: Pose = IDENTITY
    update_rate: float = 0.0  # measurements per second; 0: one in each step
    topic: str = ""
    plugins: tuple[Plugin, ...] = ()


class Light(NamedTuple):
    """A light: ``point``, ``directional`` or ``spot``."""

    name: str
    kind: str
    pose: Pose = IDENTITY
    diffuse: Color = (1.0, 1.0, 1.0, 1.0)
    specular: Color = (0.1, 0.1, 0.1, 1.0)
    direction: Vector = (0.0, 0.0, -1.0)
    range: float = 10.0
    casts_shadows: bool = False


@dataclass(frozen=True)
class Link:
    """A rigid body."""

    name: str
    pose: Pose = IDENTITY
    inertial: Inertial = _INERTIAL
    collisions: tuple[Collision, ...] = ()
    visuals: tuple[Visual, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    lights: tuple[Light, ...] = ()
    has_gravity: bool = True
    self_collide: bool = False
    linear_damping: float = 0.0
    angular_damping: float = 0.0


class Axis(NamedTuple):
    """A joint's axis in the joint's frame, with its limits (infinite: no limit) and passive forces."""

    xyz: Vector = (0.0, 0.0, 1.0)
    lower: float = float("-inf")
    upper: float = float("inf")
    effort: float = float("inf")
    velocity: float = float("inf")
    damping: float = 0.0
    friction: float = 0.0
    spring_stiffness: float = 0.0
    spring_reference: float = 0.0
    initial_position: float = 0.0


_AXIS = Axis()


class Mimic(NamedTuple):
    """Makes a joint follow another one: its position is ``multiplier * position of joint + offset``."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Joint:
    """A joint: ``revolute``, ``continuous``, ``prismatic``, ``fixed``, ``ball`` or ``universal``.

    If ``parent`` is ``world``, the joint attaches the child to the world.
    """

    name: str
    kind: str
    parent: str
    child: str
    pose: Pose = IDENTITY
    axis: Axis = _AXIS
    axis2: Axis = _AXIS
    mimic: Mimic | None = None
    sensors: tuple[Sensor, ...] = ()


@dataclass(frozen=True)
class Model:
    """A model: links and joints by name, in file order.

    ``lumped``: for each link that was merged into another one, the other link's name and the merged link's pose in it, so that
    plugins can find it. ``warnings``: one line for each part that was dropped or changed.
    """

    name: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint] = field(default_factory=dict)
    pose: Pose = IDENTITY
    is_static: bool = False
    self_collide: bool = False
    plugins: tuple[Plugin, ...] = ()
    lumped: Mapping[str, tuple[str, Pose]] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()


class Physics(NamedTuple):
    """The physics engine's parameters; the defaults are Gazebo's."""

    step: float = 0.001
    real_time_factor: float = 1.0
    update_rate: float = 1000.0  # steps per second; 0: as fast as possible
    gravity: Vector = (0.0, 0.0, -9.8)
    iterations: int = 50
    sor: float = 1.3
    max_contacts: int = 20


_PHYSICS = Physics()


@dataclass(frozen=True)
class World:
    """A world: its models and lights, in file order."""

    name: str = "default"
    models: tuple[Model, ...] = ()
    lights: tuple[Light, ...] = ()
    physics: Physics = _PHYSICS
    plugins: tuple[Plugin, ...] = ()
    ambient: Color = (0.4, 0.4, 0.4, 1.0)
    background: Color = (0.7, 0.7, 0.7, 1.0)
    camera: Pose | None = None  # the pose of the window's camera
    warnings: tuple[str, ...] = ()
