"""Models, links and joints of the running simulation. They remain valid until their model is removed.

:class:`Simulation` provides them; use them only in its thread.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from minirospy.core.sdf.model import Axis, Inertial, Joint, Link, Model, Pose, Vector
from minirospy.core.sdf.poses import (
    add,
    compose,
    cross,
    difference,
    inverse,
    normalized,
    rotate,
    rotate_back,
    transform,
)
from minirospy.ros.gazebo_ros.physics.builder import BuiltModel, axis_names, set_inertial
from minirospy.ros.gazebo_ros.physics.engine import MAX_FORCE, MAX_MOTOR_SPEED, Engine
from minirospy.ros.gazebo_ros.physics.library import SimulationError
from minirospy.ros.gazebo_ros.physics.states import ZERO, State, Wrench

__all__ = ["Owner", "SimJoint", "SimLink", "SimModel"]


class Owner(Protocol):
    """The simulation's interface for models."""

    engine: Engine
    forced: dict[str, None]

    @property
    def time(self) -> float:
        """Return the simulated time in seconds."""

    def recompile(self) -> None:
        """Compile the world again."""

    def set_axis(self, scoped: str, kind: str, axis: Axis) -> None:
        """Change a MuJoCo joint's limits and passive forces."""


@dataclass
class TimedWrench:
    """A wrench in world axes at a point on the link, active while ``start`` <= time < ``end`` (s)."""

    force: Vector
    torque: Vector
    point: Vector
    start: float
    end: float


@dataclass
class TimedForce:
    """A joint's force or torque, active while ``start`` <= time < ``end`` (s)."""

    force: float
    start: float
    end: float


class SimLink:
    """A rigid body."""

    def __init__(self, engine: Engine, model: SimModel, record: Link) -> None:
        self.engine = engine
        self.model = model
        self.record = record
        self.name = record.name
        self.id = 0  # MuJoCo's body id; each compilation may change it
        self.wrenches: list[TimedWrench] = []
        self.has_damping = (record.linear_damping > 0 or record.angular_damping > 0) and not model.is_static

    @property
    def scoped_name(self) -> str:
        """Return ``model::link``."""
        return f"{self.model.name}::{self.name}"

    @property
    def pose(self) -> Pose:
        """Return the link's pose in the world."""
        self.engine.refresh()
        data = self.engine.data
        return _pose(data.xpos[self.id], data.xquat[self.id])

    @property
    def state(self) -> State:
        """Return the link's pose and the velocity of its origin."""
        pose = self.pose
        engine = self.engine
        velocity = np.zeros(6)
        kind = engine.mujoco.mjtObj.mjOBJ_XBODY
        engine.mujoco.mj_objectVelocity(engine.model, engine.data, kind, self.id, velocity, 0)
        wx, wy, wz, vx, vy, vz = velocity.tolist()
        return State(pose, (vx, vy, vz), (wx, wy, wz))

    def set_state(self, state: State) -> None:
        """Move the whole model so that this link has the given state. Keep the joint positions and stop the joints."""
        _check(self, *state.pose.position, *state.pose.orientation, *state.linear, *state.angular)
        self.model.move(self.pose, state)

    @property
    def center_of_mass(self) -> Vector:
        """Return the world position of the centre of mass."""
        self.engine.refresh()
        x, y, z = self.engine.data.xipos[self.id].tolist()
        return x, y, z

    @property
    def has_gravity(self) -> bool:
        """Return whether gravity acts on the link."""
        return float(self.engine.model.body_gravcomp[self.id]) == 0.0

    @has_gravity.setter
    def has_gravity(self, value: bool) -> None:
        self.model.built.bodies[self.name].gravcomp = 0.0 if value else 1.0
        if self.engine.model.ngravcomp:
            self.engine.model.body_gravcomp[self.id] = 0.0 if value else 1.0
            self.engine.is_stale = True
        else:
            self.model.simulation.recompile()

    def set_inertial(self, inertial: Inertial) -> None:
        """Change the mass and inertia and recompile the world. For a static model, only store them."""
        _check(self, inertial.mass, *inertial.inertia, *inertial.pose.position, *inertial.pose.orientation)
        if inertial.mass <= 0:
            raise SimulationError(f"{self.scoped_name}: a mass must be positive")
        self.record = replace(self.record, inertial=inertial)
        if not self.model.is_static:
            set_inertial(self.model.built.bodies[self.name], inertial)
            self.model.simulation.recompile()

    def add_wrench(
        self,
        force: Vector = ZERO,
        torque: Vector = ZERO,
        *,
        point: Vector = ZERO,
        start: float = 0.0,
        duration: float = math.inf,
    ) -> None:
        """Apply a force and torque in world axes at a point in the link's frame.

        ``start``: simulation time in seconds; a time in the past means now. A negative duration means forever.
        """
        _check(self, *force, *torque, *point)
        start, end = self.model.force_changes(start, duration)
        self.wrenches.append(TimedWrench(force, torque, point, start, end))

    def push(self, force: Vector = ZERO, torque: Vector = ZERO, *, point: Vector = ZERO) -> None:
        """Apply a force and torque in world axes at a point in the link's frame, for the next step only."""
        _check(self, *force, *torque, *point)
        self.wrenches.append(TimedWrench(force, torque, point, *self.model.force_changes(0.0, 0.0)))

    def clear_wrenches(self) -> None:
        """Remove all wrenches added by :meth:`add_wrench`."""
        self.wrenches.clear()

    def apply_wrenches(self, now: float) -> bool:
        """Pass this step's forces to MuJoCo and remove expired ones. Return whether any remain."""
        step = self.engine.physics.step
        row = self.engine.data.xfrc_applied[self.id]
        position, orientation = self.pose
        center = self.center_of_mass
        for each in self.wrenches:
            if each.start <= now + 0.5 * step:
                arm = add(rotate(orientation, each.point), difference(position, center))
                row[:3] += each.force
                row[3:] += add(each.torque, cross(arm, each.force))
        self.wrenches = [each for each in self.wrenches if each.end > now + 1.5 * step]
        if self.has_damping:
            # As in ODE, velocity decay removes a fraction of the velocity in each step.
            _, linear, angular = self.state
            mass = float(self.engine.model.body_mass[self.id])
            moments = self.engine.model.body_inertia[self.id].tolist()
            loss = min(self.record.linear_damping, 1.0) * mass / step
            slow = min(self.record.angular_damping, 1.0) * min(moments) / step
            row[:3] -= [loss * value for value in linear]
            row[3:] -= [slow * value for value in angular]
        return bool(self.wrenches) or self.has_damping


class SimJoint:
    """A joint, or one axis of a universal joint. A fixed or ball joint has no axis; its position is 0.

    Positions are in rad or m, velocities in rad/s or m/s, forces in N m or N.
    """

    def __init__(self, engine: Engine, model: SimModel, record: Joint, axis: Axis, scoped: str) -> None:
        self.engine = engine
        self.model = model
        self.record = record
        self.axis = axis
        self.name = record.name
        self.scoped = scoped  # name in MuJoCo; empty for a fixed joint and for one outside the body tree
        self.second: SimJoint | None = None  # the second axis of a universal joint
        self.dof = -1  # index of the joint's degree of freedom in MuJoCo; each compilation may change it
        self._address = -1
        self._force = 0.0
        self._timed: list[TimedForce] = []
        self._max_force = 0.0  # the motor's maximum force; 0 without a motor
        self._velocity = 0.0
        self._target: float | None = None
        self._max_velocity = MAX_MOTOR_SPEED

    @property
    def has_axis(self) -> bool:
        """Return whether the joint can move about or along an axis."""
        return self.dof >= 0

    @property
    def position(self) -> float:
        """Return the joint's position in rad or m."""
        return float(self.engine.data.qpos[self._address]) if self.dof >= 0 else 0.0

    @property
    def velocity(self) -> float:
        """Return the joint's velocity in rad/s or m/s."""
        return float(self.engine.data.qvel[self.dof]) if self.dof >= 0 else 0.0

    @property
    def effort(self) -> float:
        """Return the last step's force: the applied force plus that of the motor or joint friction."""
        if self.dof < 0:
            return 0.0
        engine = self.engine
        return float(engine.data.qfrc_applied[self.dof] + engine.motor_force[self.dof])

    def set_state(self, position: float, velocity: float = 0.0) -> None:
        """Set the position and velocity immediately."""
        _check(self, position, velocity)
        if self.dof >= 0:
            self.engine.data.qpos[self._address] = position
            self.engine.data.qvel[self.dof] = velocity
            self.engine.is_stale = True

    def set_axis(self, axis: Axis) -> None:
        """Change the axis's limits, damping, friction and spring, but not its direction, and recompile the world.

        Raise SimulationError if damping or friction is not finite, or a limit is NaN.
        """
        name = f"{self.model.name}::{self.name}"
        if not (math.isfinite(axis.damping) and math.isfinite(axis.friction)):
            raise SimulationError(f"{name}: the damping or friction is not finite")
        if math.isnan(axis.lower) or math.isnan(axis.upper):
            raise SimulationError(f"{name}: the limit NaN is not finite")
        self.axis = axis._replace(xyz=self.axis.xyz, initial_position=self.axis.initial_position)
        if self.dof >= 0:
            self.model.simulation.set_axis(self.scoped, self.record.kind, self.axis)

    def set_velocity_now(self, velocity: float) -> None:
        """Set the velocity immediately."""
        if self.dof >= 0:
            self.engine.data.qvel[self.dof] = velocity
            self.engine.is_stale = True

    def set_force(self, force: float) -> None:
        """Apply a force in each step until it is replaced. The joint's effort and velocity limits may reduce it."""
        _check(self, force)
        self._force = force
        self.model.force_changes()

    def add_force(self, force: float, *, start: float = 0.0, duration: float = math.inf) -> None:
        """Apply a force from ``start`` (s; now if in the past) for ``duration`` (s; forever if negative)."""
        _check(self, force)
        self._timed.append(TimedForce(force, *self.model.force_changes(start, duration)))

    def clear_forces(self) -> None:
        """Remove the forces from :meth:`set_force` and :meth:`add_force`."""
        self._force = 0.0
        self._timed.clear()
        self.model.force_changes()

    def set_velocity(self, velocity: float, max_force: float = math.inf) -> None:
        """Start or update a motor that holds a velocity with limited force."""
        _check(self, velocity)
        self._velocity, self._target = min(max(velocity, -MAX_MOTOR_SPEED), MAX_MOTOR_SPEED), None
        self._start_motor(max_force)

    def set_position(
        self, position: float, max_force: float = math.inf, max_velocity: float = math.inf
    ) -> None:
        """Start or update a motor that moves to a position with limited force and velocity."""
        _check(self, position)
        self._velocity, self._target = 0.0, position
        self._max_velocity = min(max_velocity, MAX_MOTOR_SPEED)
        self._start_motor(max_force)

    def stop_motor(self) -> None:
        """Remove the motor so that the joint moves freely."""
        self._max_force, self._target, self._velocity = 0.0, None, 0.0
        self._write_motor()

    def _start_motor(self, max_force: float) -> None:
        if math.isnan(max_force):
            raise SimulationError(f"{self.model.name}::{self.name}: the motor's maximum force is not finite")
        force = min(max(max_force, 0.0), MAX_FORCE)
        same = force == self._max_force > 0 and self.dof >= 0
        self._max_force = force
        if same and self._target is None and not self.engine.follows_position[self.dof]:
            self.engine.set_target(self.dof, self._velocity)
        elif same and self._target is not None and self.engine.follows_position[self.dof]:
            self.engine.target_position[self.dof] = self._target
            self.engine.max_velocity[self.dof] = self._max_velocity
        else:
            self._write_motor()

    def _write_motor(self) -> None:
        if self.dof < 0:
            return
        engine, dof = self.engine, self.dof
        friction, damping = max(self.axis.friction, 0.0), max(self.axis.damping, 0.0)
        engine.model.dof_frictionloss[dof] = self._max_force or friction
        engine.motor_limit[dof] = self._max_force
        engine.motor_damping[dof] = damping if self._max_force else 0.0
        engine.model.dof_damping[dof] = 0.0 if self._max_force else damping
        # Without a motor, the same constraint models the joint's friction, so its target velocity is 0.
        engine.target_velocity[dof] = self._velocity if self._max_force else 0.0
        engine.follows_position[dof] = self._target is not None and self._max_force > 0
        if self._target is not None:
            engine.target_position[dof] = self._target
        engine.max_velocity[dof] = self._max_velocity
        engine.motors_changed()
        engine.is_stale = True

    def bind(self) -> None:
        """Look up the joint in the newly compiled MuJoCo model, and restore the motor's settings there."""
        if not self.scoped or self.record.kind == "ball":
            return
        row = self.engine.model.joint(self.scoped)
        self.dof, self._address = int(row.dofadr[0]), int(row.qposadr[0])
        if self._max_force or self.engine.model.dof_frictionloss[self.dof] != max(self.axis.friction, 0.0):
            self._write_motor()

    def apply_forces(self, now: float) -> bool:
        """Apply this step's force. Return whether forces remain for later steps."""
        if self.dof < 0:
            return False
        force = self._force
        if self._timed:
            step = self.engine.physics.step
            force += sum(each.force for each in self._timed if each.start <= now + 0.5 * step)
            self._timed = [each for each in self._timed if each.end > now + 1.5 * step]
        limit, fastest = self.axis.effort, self.axis.velocity
        if 0 <= limit < math.inf:
            force = min(max(force, -limit), limit)
        if force and 0 < fastest < math.inf:
            velocity = self.velocity
            if (velocity > fastest and force > 0) or (velocity < -fastest and force < 0):
                force = 0.0
        self.engine.data.qfrc_applied[self.dof] = force
        return bool(self._force or self._timed)

    def reset(self) -> None:
        """Return to the initial position; remove the forces and the motor."""
        self.clear_forces()
        self.stop_motor()
        self.set_state(self.axis.initial_position)

    def wrench(self) -> Wrench:
        """Return the force and torque that the child link exerts on its parent at the joint, in the child's axes.

        They belong to the last step, and require ``Simulation.records_details``.
        """
        engine = self.engine
        link = self.model.links[self.record.child]
        torque_x, torque_y, torque_z, *rest = engine.joint_wrenches[link.id].tolist()
        force: Vector = (rest[0], rest[1], rest[2])
        root = int(engine.model.body_rootid[link.id])
        reference = engine.data.subtree_com[root].tolist()
        pose = link.pose
        anchor = transform(pose, self.record.pose.position)
        arm = difference((reference[0], reference[1], reference[2]), anchor)
        torque = add((torque_x, torque_y, torque_z), cross(arm, force))
        fx, fy, fz = rotate_back(pose.orientation, force)
        tx, ty, tz = rotate_back(pose.orientation, torque)
        return Wrench((-fx, -fy, -fz), (-tx, -ty, -tz))


class SimModel:
    """A simulated model: its links and joints by name."""

    def __init__(self, simulation: Owner, name: str, record: Model, start: Pose, built: BuiltModel) -> None:
        self.simulation = simulation
        self.engine = engine = simulation.engine
        self.name = name
        self.record = record
        self.built = built
        self.start = start  # the pose that reset() restores
        self.links: Mapping[str, SimLink] = {
            key: SimLink(engine, self, link) for key, link in record.links.items()
        }
        joints: dict[str, SimJoint] = {}
        for key, joint in record.joints.items():
            names = ("",) if key not in built.joints else axis_names(f"{name}::{key}", joint) or ("",)
            joints[key] = SimJoint(engine, self, joint, joint.axis, names[0])
            if len(names) == 2:
                joints[key].second = SimJoint(engine, self, joint, joint.axis2, names[1])
        self.joints: Mapping[str, SimJoint] = joints

    @property
    def is_static(self) -> bool:
        """Return whether the model is static and never moves by itself."""
        return self.record.is_static

    @property
    def canonical_link(self) -> SimLink:
        """Return the first link, which carries the model's frame."""
        return next(iter(self.links.values()))

    @property
    def pose(self) -> Pose:
        """Return the pose of the model's frame, which is fixed to the first link."""
        link = self.canonical_link
        return compose(link.pose, inverse(link.record.pose))

    @property
    def state(self) -> State:
        """Return the pose of the model's frame and the velocity of its origin."""
        link = self.canonical_link
        state = link.state
        pose = compose(state.pose, inverse(link.record.pose))
        arm = difference(pose.position, state.pose.position)
        return State(pose, add(state.linear, cross(state.angular, arm)), state.angular)

    def set_state(self, state: State) -> None:
        """Move the model. Keep the joint positions and stop the joints."""
        _check(self, *state.pose.position, *state.pose.orientation, *state.linear, *state.angular)
        self.move(self.pose, state)

    def set_velocity(self, linear: Vector, angular: Vector) -> None:
        """Set the velocity of the model's origin in world axes. Keep the pose and the joint states."""
        _check(self, *linear, *angular)
        origin = self.pose.position
        self._set_free_velocities(linear, angular, origin)

    def move(self, base: Pose, state: State) -> None:
        """Move the model rigidly so that a frame at the pose ``base``, such as a link's, reaches ``state``. The joints stop."""
        self.engine.refresh()
        change = compose(state.pose, inverse(base))
        for joint in self.all_joints():
            joint.set_velocity_now(0.0)
        for name in self.built.roots:
            before = self.links[name].pose if name in self.built.free else self._rest_pose(name)
            self._place(name, compose(change, before))
        self.engine.is_stale = True
        self._set_free_velocities(state.linear, state.angular, state.pose.position)

    def _rest_pose(self, root: str) -> Pose:
        """Return the world pose of a root body at joint position 0. The body must not be a free one."""
        model, body = self.engine.model, self.links[root].id
        return _pose(model.body_pos[body], model.body_quat[body])

    def _place(self, root: str, pose: Pose) -> None:
        """Set a root body's pose at joint position 0."""
        engine = self.engine
        body = self.links[root].id
        x, y, z, w = normalized(pose.orientation)
        if root in self.built.free:
            address = int(engine.model.jnt_qposadr[engine.model.body_jntadr[body]])
            engine.data.qpos[address : address + 7] = (*pose.position, w, x, y, z)
            return
        spec = self.built.roots[root]  # the next compilation reads the pose from here
        spec.pos, spec.quat = pose.position, (w, x, y, z)
        engine.model.body_pos[body] = pose.position
        engine.model.body_quat[body] = (w, x, y, z)

    def _set_free_velocities(self, linear: Vector, angular: Vector, origin: Vector) -> None:
        """Give all free bodies the velocity of one rigid body. MuJoCo expects the angular part in body axes."""
        engine = self.engine
        for link in map(self.links.__getitem__, self.built.free):
            pose = link.pose
            dof = int(engine.model.body_dofadr[link.id])
            engine.data.qvel[dof : dof + 3] = add(linear, cross(angular, difference(pose.position, origin)))
            engine.data.qvel[dof + 3 : dof + 6] = rotate_back(pose.orientation, angular)
        engine.is_stale = True

    def all_joints(self) -> Iterator[SimJoint]:
        """Yield each joint; a universal joint is followed by its second axis."""
        for joint in self.joints.values():
            yield joint
            if joint.second is not None:
                yield joint.second

    def bind(self) -> None:
        """Look up MuJoCo's ids after a compilation."""
        for link in self.links.values():
            link.id = int(self.engine.model.body(link.scoped_name).id)
        for joint in self.all_joints():
            joint.bind()

    def reset(self) -> None:
        """Return to the initial pose and joint positions, at rest, without forces and motors."""
        for link in self.links.values():
            link.clear_wrenches()
        for joint in self.all_joints():
            joint.reset()
        for name in self.built.roots:
            self._place(name, compose(self.start, self.links[name].record.pose))
        self.engine.is_stale = True
        self.set_velocity(ZERO, ZERO)

    def apply_forces(self, now: float) -> bool:
        """Apply the forces of one step. Return whether forces remain for the next step."""
        remains = False
        for link in self.links.values():
            if link.wrenches or link.has_damping:
                remains = link.apply_wrenches(now) or remains
        for joint in self.all_joints():
            remains = joint.apply_forces(now) or remains
        return remains

    def force_changes(self, start: float = 0.0, duration: float = 0.0) -> tuple[float, float]:
        """Notify the simulation of a force on this model. Return the times in s at which it starts (not before now) and ends."""
        self.simulation.forced[self.name] = None
        start = max(start, self.simulation.time)
        return start, start + duration if duration >= 0 else math.inf


def _check(owner: SimLink | SimJoint | SimModel, *values: float) -> None:
    """Raise SimulationError, naming the owner, if a value is infinite or NaN."""
    if not all(map(math.isfinite, values)):
        name = owner.name if isinstance(owner, SimModel) else f"{owner.model.name}::{owner.name}"
        raise SimulationError(f"{name}: a force, position or velocity is not finite")


def _pose(position: NDArray[np.float64], wxyz: NDArray[np.float64]) -> Pose:
    x, y, z = position.tolist()
    w, qx, qy, qz = wxyz.tolist()
    return Pose((x, y, z), (qx, qy, qz, w))
