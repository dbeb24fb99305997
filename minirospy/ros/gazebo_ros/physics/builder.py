"""Converts the records of models to bodies, joints and geoms of an MjSpec."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from minirospy.core.sdf.model import (
    IDENTITY,
    Axis,
    Collision,
    Cylinder,
    Inertial,
    Joint,
    Link,
    Model,
    Physics,
    Plane,
    Pose,
    Vector,
    World,
)
from minirospy.core.sdf.poses import compose, inverse, relative, rotate, transform
from minirospy.ros.gazebo_ros.physics.inertias import principal_inertia
from minirospy.ros.gazebo_ros.physics.library import SimulationError, load_mujoco
from minirospy.ros.gazebo_ros.physics.shapes import GROUP_VISUAL, SOLREF, Shapes, to_wxyz
from minirospy.ros.gazebo_ros.physics.tree import WORLD, LinkTree, plan_tree

__all__ = [
    "MOTOR_DAMPING",
    "Builder",
    "BuiltModel",
    "axis_names",
    "count_substeps",
    "has_limits",
    "set_inertial",
]

FIXED_KINDS = ("fixed",)
MAX_LIMIT = 1e15  # larger limits count as none: SDF uses 1e16 for no limit
MIN_RANGE = 1e-5  # m or rad; half the minimum range of a joint, because MuJoCo rejects a range of length zero
MAX_LIGHTS = 8  # maximum number of lights in OpenGL
MAX_SUBSTEP = SOLREF[0] / 2  # s; with longer substeps, MuJoCo softens contacts, and wheels slip
VISUAL = "\tvisual"  # suffix that separates the names of visuals from those of collisions
MOTOR_DAMPING = 0.9999  # MuJoCo's maximum impedance: joint friction and motors are as stiff as possible


@dataclass
class BuiltModel:
    """The parts that a model has added to the MuJoCo spec.

    ``roots``: the bodies directly below the world, by link name. ``free``: those with six degrees of freedom. ``joints``: the
    joints in the body tree. ``others``: contact exclusions and equalities.
    """

    roots: dict[str, Any] = field(default_factory=dict)
    bodies: dict[str, Any] = field(default_factory=dict)
    free: set[str] = field(default_factory=set)
    joints: set[str] = field(default_factory=set)
    others: list[Any] = field(default_factory=list)


class Builder:
    """Adds models to a MuJoCo spec and deletes them."""

    def __init__(self, physics: Physics) -> None:
        mujoco = load_mujoco()
        self._mujoco = mujoco
        self.spec = mujoco.MjSpec()
        self.shapes = Shapes(self.spec)
        self.spec.compiler.degree = False
        self.spec.compiler.autolimits = False
        option = self.spec.option
        option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        option.impratio = 10.0  # reduces creep under friction to 0.5 mm in 2 s on a slope
        option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        self.set_physics(physics)
        self.has_visuals = False  # only cameras need visuals, which cost time and memory

    def set_physics(self, physics: Physics) -> None:
        """Set the time step and gravity for the next compilation."""
        self._substep = physics.step / count_substeps(physics.step)
        self.spec.option.timestep = self._substep
        self.spec.option.gravity = physics.gravity

    def add(self, model: Model, name: str, pose: Pose) -> BuiltModel:
        """Add a model at a pose. If a part cannot be simulated, add nothing and raise SimulationError."""
        built = BuiltModel()
        try:
            tree = LinkTree(order=list(model.links)) if model.is_static else plan_tree(model)
            for link_name in tree.order:
                self._add_link(built, tree, model, name, pose, model.links[link_name])
            if not model.is_static:
                self._add_excludes(built, model, name)
                for joint in tree.loops:
                    self._add_loop(built, model, name, joint)
                self._add_mimics(built, model, name)
        except Exception as error:
            self.delete(built)
            self.shapes.warnings.clear()  # otherwise the next model added would also report them
            if isinstance(error, SimulationError):
                raise SimulationError(f"model '{name}': {error}") from error.__cause__
            if isinstance(error, (ValueError, TypeError, OSError)):
                raise SimulationError(f"model '{name}': {_first_line(error)}") from error
            raise
        return built

    def add_scene(self, world: World) -> None:
        """Add a world's background and lights, and the visuals of all models added from now on."""
        self.has_visuals = True
        mujoco = self._mujoco
        red, green, blue, _ = world.background
        self.spec.add_texture(
            name="background",
            type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
            builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
            rgb1=[red, green, blue],
            rgb2=[red, green, blue],
            width=8,
            height=48,
        )
        ambient = [min(value, 1.0) for value in world.ambient[:3]]
        head = self.spec.visual.headlight
        head.ambient = ambient
        head.diffuse = [0.2, 0.2, 0.2] if world.lights else [0.6, 0.6, 0.6]
        head.specular = [0.0, 0.0, 0.0]
        for light in world.lights[:MAX_LIGHTS]:
            row = self.spec.worldbody.add_light(
                pos=light.pose.position, dir=rotate(light.pose.orientation, light.direction)
            )
            row.diffuse, row.specular = light.diffuse[:3], light.specular[:3]
            row.castshadow = light.casts_shadows
            is_directional = light.kind == "directional"
            if hasattr(row, "directional"):
                row.directional = is_directional
            else:
                kinds = mujoco.mjtLightType
                names = {"directional": kinds.mjLIGHT_DIRECTIONAL, "spot": kinds.mjLIGHT_SPOT}
                row.type = names.get(light.kind, kinds.mjLIGHT_POINT)

    def add_visuals(self, built: BuiltModel, model: Model, name: str) -> list[str]:
        """Add a model's visuals. Leave out unreadable ones, and return a warning for each of these."""
        warnings: list[str] = []
        for link in model.links.values():
            for visual in link.visuals:
                scoped = f"{name}::{link.name}::{visual.name}{VISUAL}"
                try:
                    self.shapes.add_visual(built.bodies[link.name], scoped, visual)
                except (SimulationError, ValueError, TypeError) as error:
                    warnings.append(f"model '{name}': visual '{visual.name}': {_first_line(error)}")
        return warnings + self.take_warnings(name)

    def delete_visuals(self, built: BuiltModel) -> None:
        """Delete a model's visuals."""
        for body in built.bodies.values():
            for geom in [each for each in body.geoms if each.group == GROUP_VISUAL]:
                self.spec.delete(geom)

    def take_warnings(self, name: str) -> list[str]:
        """Return and clear the warnings about the shapes of the last model added."""
        lines = [f"model '{name}': {line}" for line in self.shapes.warnings]
        self.shapes.warnings.clear()
        return lines

    def delete(self, built: BuiltModel) -> None:
        """Delete a model from the spec."""
        for each in built.others:
            self.spec.delete(each)
        for body in built.roots.values():
            self.spec.delete(body)
        built.roots, built.bodies, built.others = {}, {}, []

    def _add_link(
        self, built: BuiltModel, tree: LinkTree, model: Model, name: str, pose: Pose, link: Link
    ) -> None:
        joint = tree.joint_of.get(link.name)
        _check_numbers(link, joint)
        scoped = f"{name}::{link.name}"
        if joint is None or joint.parent == WORLD:
            body = self.spec.worldbody.add_body(name=scoped)
            built.roots[link.name] = body
            local = compose(pose, link.pose)
        else:
            body = built.bodies[joint.parent].add_body(name=scoped)
            local = relative(model.links[joint.parent].pose, link.pose)
        built.bodies[link.name] = body
        body.pos, body.quat = local.position, to_wxyz(local.orientation)

        if not model.is_static:
            body.explicitinertial = True
            set_inertial(body, link.inertial)
            body.gravcomp = 0.0 if link.has_gravity else 1.0
            if joint is None:
                body.add_freejoint(name=scoped)
                built.free.add(link.name)
            else:
                self._add_joint(body, f"{name}::{joint.name}", joint)
                built.joints.add(joint.name)

        for collision in link.collisions:
            self.shapes.add_collision(
                body,
                f"{scoped}::{collision.name}",
                collision,
                is_static=model.is_static,
                turns=joint is not None and _turns_freely(joint),
                is_wheel=joint is not None and _is_wheel(joint, collision),
                is_wall=model.is_static and _is_steep(compose(local, collision.pose), collision),
            )

    def _add_joint(self, body: Any, scoped: str, joint: Joint) -> None:
        kinds = self._mujoco.mjtJoint
        if joint.kind in FIXED_KINDS:
            return
        if joint.kind == "ball":
            body.add_joint(name=scoped, type=kinds.mjJNT_BALL, pos=joint.pose.position)
            return
        if joint.kind not in ("revolute", "continuous", "prismatic", "universal"):
            raise SimulationError(f"joint '{joint.name}' has the unknown type '{joint.kind}'")
        slides = joint.kind == "prismatic"
        for axis_name, axis in zip(axis_names(scoped, joint), (joint.axis, joint.axis2), strict=False):
            row = body.add_joint(name=axis_name, type=kinds.mjJNT_SLIDE if slides else kinds.mjJNT_HINGE)
            row.pos = joint.pose.position
            row.axis = _direction(joint, axis)
            row.solref_friction = [-1 / self._substep, -1 / self._substep]
            row.solimp_friction = [MOTOR_DAMPING, MOTOR_DAMPING, 0.001, 0.5, 2.0]
            row.solref_limit = [0.005, 1.0]
            row.solimp_limit = [0.95, 0.99, 0.001, 0.5, 2.0]
            self.set_axis(axis_name, joint.kind, axis)

    def set_axis(self, name: str, kind: str, axis: Axis) -> None:
        """Set the limits and passive forces of a MuJoCo joint."""
        row = self.spec.joint(name)
        _set_first(row, "damping", max(axis.damping, 0.0))
        _set_first(row, "stiffness", max(axis.spring_stiffness, 0.0))
        row.springref = axis.spring_reference
        row.frictionloss = max(axis.friction, 0.0)
        row.limited = kind != "continuous" and has_limits(axis)
        if row.limited:
            lower, upper = sorted((axis.lower, axis.upper))
            if upper - lower < 2 * MIN_RANGE:
                lower, upper = lower - MIN_RANGE, upper + MIN_RANGE
            row.range = [max(lower, -MAX_LIMIT), min(upper, MAX_LIMIT)]

    def _add_excludes(self, built: BuiltModel, model: Model, name: str) -> None:
        """Exclude contacts within the model or, if it collides with itself, only those between links with a common joint."""
        with_shapes = [link for link in model.links.values() if link.collisions]
        joined = {frozenset((joint.parent, joint.child)) for joint in model.joints.values()}
        for index, first in enumerate(with_shapes):
            for second in with_shapes[index + 1 :]:
                both = model.self_collide or (first.self_collide and second.self_collide)
                if both and frozenset((first.name, second.name)) not in joined:
                    continue
                built.others.append(
                    self.spec.add_exclude(
                        bodyname1=f"{name}::{first.name}", bodyname2=f"{name}::{second.name}"
                    )
                )

    def _add_loop(self, built: BuiltModel, model: Model, name: str, joint: Joint) -> None:
        """Close a kinematic loop with an equality constraint: a weld, or connections at one or two points on the axis."""
        child = model.links[joint.child].pose
        parent = IDENTITY if joint.parent == WORLD else model.links[joint.parent].pose
        first = f"{name}::{joint.child}"
        second = "" if joint.parent == WORLD else f"{name}::{joint.parent}"
        if joint.kind == "prismatic":
            raise SimulationError(f"joint '{joint.name}' closes a loop: a prismatic joint cannot do that")
        equality = self._mujoco.mjtEq
        if joint.kind == "fixed":
            pose = relative(child, parent)  # the parent's pose in the child's frame
            data = [0.0] * 11
            data[3:6] = pose.position
            data[6:10] = to_wxyz(pose.orientation)
            data[10] = 1.0
            self._add_equality(built, equality.mjEQ_WELD, first, second, data)
            return
        x, y, z = joint.pose.position
        points: list[Vector] = [(x, y, z)]
        if joint.kind in ("revolute", "continuous"):
            ax, ay, az = _direction(joint, joint.axis)
            points = [(x + s * ax, y + s * ay, z + s * az) for s in (-0.05, 0.05)]
        for point in points:
            data = [0.0] * 11
            data[0:3] = point
            data[3:6] = transform(inverse(parent), transform(child, point))
            self._add_equality(built, equality.mjEQ_CONNECT, first, second, data)

    def _add_equality(self, built: BuiltModel, kind: Any, first: str, second: str, data: list[float]) -> None:
        row = self.spec.add_equality(type=kind, objtype=self._mujoco.mjtObj.mjOBJ_BODY, name1=first)
        row.name2 = second
        row.data[: len(data)] = data
        row.solref = [0.005, 1.0]
        built.others.append(row)

    def _add_mimics(self, built: BuiltModel, model: Model, name: str) -> None:
        for joint in model.joints.values():
            mimic = joint.mimic
            leader = model.joints.get(mimic.joint) if mimic else None
            if mimic is None or leader is None or joint.kind in ("fixed", "ball") or leader.kind == "fixed":
                continue
            row = self.spec.add_equality(
                type=self._mujoco.mjtEq.mjEQ_JOINT, objtype=self._mujoco.mjtObj.mjOBJ_JOINT
            )
            row.name1, row.name2 = f"{name}::{joint.name}", f"{name}::{mimic.joint}"
            row.data[:2] = (mimic.offset, mimic.multiplier)
            row.data[2:] = 0.0
            row.solref = [0.005, 1.0]
            built.others.append(row)


def set_inertial(body: Any, inertial: Inertial) -> None:
    """Set the mass and inertia of a MuJoCo body."""
    inertia = principal_inertia(inertial)
    body.mass, body.inertia = inertia.mass, inertia.moments
    body.ipos, body.iquat = inertia.pose.position, to_wxyz(inertia.pose.orientation)


def count_substeps(step: float) -> int:
    """Return the number of MuJoCo steps per world step; ``step`` is the world step in seconds."""
    return max(1, math.ceil(step / MAX_SUBSTEP - 1e-9))


def axis_names(scoped: str, joint: Joint) -> tuple[str, ...]:
    """Return the names of a joint's MuJoCo joints: one per axis, none for a fixed joint."""
    if joint.kind in FIXED_KINDS:
        return ()
    return (scoped, f"{scoped}/1") if joint.kind == "universal" else (scoped,)


def has_limits(axis: Axis) -> bool:
    """Return whether at least one limit is finite."""
    return max(axis.lower, axis.upper) < MAX_LIMIT or min(axis.lower, axis.upper) > -MAX_LIMIT


def _turns_freely(joint: Joint) -> bool:
    """Return whether a joint rotates without position limits."""
    return joint.kind == "continuous" or (joint.kind == "revolute" and not has_limits(joint.axis))


def _is_wheel(joint: Joint, collision: Collision) -> bool:
    """Return whether a collision is a short cylinder that a joint without limits turns about the cylinder's axis."""
    shape = collision.geometry
    if not _turns_freely(joint) or not isinstance(shape, Cylinder) or shape.length > 2 * shape.radius:
        return False
    axis, along = _direction(joint, joint.axis), rotate(collision.pose.orientation, (0.0, 0.0, 1.0))
    length = math.hypot(*axis)
    cosine = sum(a * b for a, b in zip(axis, along, strict=True)) / length
    offset = [a - b for a, b in zip(joint.pose.position, collision.pose.position, strict=True)]
    shift = sum(a * b for a, b in zip(offset, along, strict=True))
    distance = math.sqrt(max(sum(a * a for a in offset) - shift * shift, 0.0))
    return abs(cosine) > 0.999 and distance < 0.01 * shape.radius


def _is_steep(pose: Pose, collision: Collision) -> bool:
    """Return whether a collision is a plane closer to vertical than to horizontal. ``pose`` is the collision's world pose."""
    shape = collision.geometry
    if not isinstance(shape, Plane):
        return False
    length = math.hypot(*shape.normal)
    return abs(rotate(pose.orientation, shape.normal)[2]) < 0.5 * length


def _check_numbers(link: Link, joint: Joint | None) -> None:
    """Raise SimulationError if a number is not finite or a joint limit is NaN, because MuJoCo accepts NaN."""
    inertial = link.inertial
    values = [*link.pose.position, *link.pose.orientation, inertial.mass, *inertial.inertia]
    values += [*inertial.pose.position, *inertial.pose.orientation]
    for collision in link.collisions:
        values += [*collision.pose.position, *collision.pose.orientation]
    if not all(map(math.isfinite, values)):
        raise SimulationError(f"link '{link.name}' has a pose or inertia that is not finite")
    if joint is None:
        return
    values = [*joint.pose.position]
    limits: list[float] = []
    for axis in (joint.axis, joint.axis2):
        values += [*axis.xyz, axis.damping, axis.friction, axis.spring_stiffness]
        values += [axis.spring_reference, axis.initial_position]
        limits += [axis.lower, axis.upper, axis.effort, axis.velocity]
    if not all(map(math.isfinite, values)):
        raise SimulationError(
            f"joint '{joint.name}' has a pose, axis, damping, friction or spring that is not finite"
        )
    if any(map(math.isnan, limits)):
        raise SimulationError(f"joint '{joint.name}' has a limit that is NaN")


def _direction(joint: Joint, axis: Axis) -> Vector:
    """Return a joint axis in the child link's frame."""
    if not math.hypot(*axis.xyz) > 1e-9:
        raise SimulationError(f"joint '{joint.name}' has an axis of length zero")
    return rotate(joint.pose.orientation, axis.xyz)


def _set_first(row: Any, name: str, value: float) -> None:
    """Set a coefficient. Before MuJoCo 4, it is a number; since then, it is the first coefficient of a polynomial."""
    if isinstance(getattr(row, name), float):
        setattr(row, name, value)
    else:
        getattr(row, name)[0] = value


def _first_line(error: BaseException) -> str:
    lines = str(error).strip().splitlines()
    return " ".join(lines[:2]) if lines else type(error).__name__
