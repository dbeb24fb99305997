"""MuJoCo's compiled model and data, advanced in substeps, with motors that behave like ODE's.

A step of the world consists of several substeps, because contacts become soft if MuJoCo's time step is long.

After each substep, body positions, contacts and velocities are those of the new time. A substep is therefore the second half of
one ``mj_step`` (forces, solver, integration) and the first half of the next.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from minirospy.core.sdf.model import Physics
from minirospy.ros.gazebo_ros.physics.builder import MOTOR_DAMPING, Builder, count_substeps
from minirospy.ros.gazebo_ros.physics.library import load_mujoco
from minirospy.ros.gazebo_ros.physics.shapes import GROUP_COLLISION, GROUP_RAY_ONLY

__all__ = ["Engine"]

RAY_GROUPS = np.array([each in (GROUP_COLLISION, GROUP_RAY_ONLY) for each in range(6)], np.uint8)
MIN_SWING = 0.5  # rad/s; slower joints need no correction of Coriolis forces
MIN_GRAIN = 0.1  # sine of the angle to the normal, below which a friction direction is ignored
MIN_FRICTION = 1e-5  # MuJoCo's own
MAX_FORCE = 1e9  # N or N m; for motors without a force limit
MAX_MOTOR_SPEED = 1e4  # rad/s or m/s; faster motor targets make contacts unstable


class Engine:
    """The compiled world in MuJoCo.

    A motor is a row of joint friction with a nonzero target velocity, like ODE's motors: the solver maintains the velocity with
    at most the maximum force. MuJoCo computes such a row's reference acceleration as ``-b * velocity``; this class adds ``b *
    target`` between the two halves of a step.
    """

    def __init__(self, builder: Builder, physics: Physics) -> None:
        self.mujoco = load_mujoco()
        self._builder = builder
        self._set_step(physics)
        self.model: Any = builder.spec.compile()
        self.data: Any = self.mujoco.MjData(self.model)
        self.generation = 0  # incremented by each compilation, which changes body and joint ids
        self.is_stale = True  # whether positions have changed since the last forward computation
        self.records_details = False  # whether contact and joint forces are recorded for readers
        self.contacts: NDArray[np.int32] = np.zeros((0, 2), np.int32)
        self.contact_points: NDArray[np.float64] = np.zeros((0, 3))
        self.contact_frames: NDArray[np.float64] = np.zeros((0, 9))
        self.contact_depths: NDArray[np.float64] = np.zeros(0)
        self.contact_wrenches: NDArray[np.float64] = np.zeros((0, 6))
        self.joint_wrenches: NDArray[np.float64] = np.zeros((1, 6))
        self._has_normals = "normal:" in (self.mujoco.mj_multiRay.__doc__ or "")
        self._size_arrays()

    def _set_step(self, physics: Physics) -> None:
        self.physics = physics
        self.substeps = count_substeps(physics.step)  # MuJoCo steps per world step
        self.substep = physics.step / self.substeps  # s

    def _size_arrays(self) -> None:
        count = self.model.nv
        self.target_velocity: NDArray[np.float64] = np.zeros(count)
        self.motor_force: NDArray[np.float64] = np.zeros(count)  # the motors' forces in the last step
        self.target_position: NDArray[np.float64] = np.zeros(count)
        self.max_velocity: NDArray[np.float64] = np.full(count, MAX_MOTOR_SPEED)
        self.follows_position: NDArray[np.bool_] = np.zeros(count, np.bool_)
        self.motor_limit: NDArray[np.float64] = np.zeros(count)  # force limits of motors on damped joints
        self.motor_damping: NDArray[np.float64] = np.zeros(count)  # damping of joints with motors, else 0
        self._damped: NDArray[np.intp] = np.zeros(0, np.intp)
        self._followers: NDArray[np.intp] = np.zeros(0, np.intp)
        self._follower_positions: NDArray[np.intp] = np.zeros(0, np.intp)
        self._bias: NDArray[np.float64] = np.zeros(count)
        self.position_of_dof: NDArray[np.intp] = np.zeros(count, np.intp)
        dofs, positions = self.model.jnt_dofadr, self.model.jnt_qposadr
        self.position_of_dof[dofs] = positions
        self._swinging = self._find_swinging()
        self._ray_counts = self._count_ray_geoms()
        self._find_grains()
        self._set_friction_rows()

    def _set_friction_rows(self) -> None:
        rate = 1 / self.substep
        self._rate = rate / MOTOR_DAMPING
        self.model.dof_solref[:] = (-rate, -rate)
        self.model.dof_solimp[:] = (MOTOR_DAMPING, MOTOR_DAMPING, 0.001, 0.5, 2.0)

    def recompile(self) -> None:
        """Compile the changed spec, keeping the time and the other models' states. Raise ValueError if it is invalid."""
        self.model, self.data = self._builder.spec.recompile(self.model, self.data)
        self.generation += 1
        self.is_stale = True
        self._size_arrays()
        self._forget_details()

    def set_physics(self, physics: Physics) -> None:
        """Set the time step and gravity."""
        self._set_step(physics)
        self.model.opt.timestep = self.substep
        self.model.opt.gravity[:] = physics.gravity
        self._builder.set_physics(physics)
        self._set_friction_rows()
        self.motors_changed()
        self.is_stale = True

    def motors_changed(self) -> None:
        """Record that motor targets have changed."""
        self._bias = self.target_velocity * self._rate
        self._damped = np.flatnonzero(self.motor_damping)
        self._followers = np.flatnonzero(self.follows_position)
        self._follower_positions = self.position_of_dof[self._followers]

    def set_target(self, dof: int, velocity: float) -> None:
        """Set one motor's target velocity."""
        self.target_velocity[dof] = velocity
        self._bias[dof] = velocity * self._rate

    def refresh(self) -> None:
        """Compute the bodies' positions, contacts and velocities if the state has changed."""
        if self.is_stale:
            self.is_stale = False
            self._begin()
            self._forget_details()

    def advance(self, left: int = 1) -> None:
        """Advance by one substep; ``left`` counts the substeps left in the world step, including this one."""
        model, data, mujoco = self.model, self.data, self.mujoco
        self.refresh()
        if self._followers.size:
            self._follow(left)
        rows = slice(data.ne, data.ne + data.nf)
        dofs = data.efc_id[rows] if data.nf else None
        if dofs is not None:
            data.efc_aref[rows] += self._bias[dofs]

        correction = self._coriolis_correction() if self._swinging.size else None
        if correction is None:
            mujoco.mj_step2(model, data)
        else:
            applied = data.qfrc_applied.copy()
            data.qfrc_applied[:] += correction
            mujoco.mj_step2(model, data)
            data.qfrc_applied[:] = applied
        if dofs is not None:
            self.motor_force[dofs] = data.efc_force[rows]
        if self._damped.size:
            self._limit_damped()
        if self.records_details and left == 1:
            self._record()
        self._begin()

    def _begin(self) -> None:
        """Compute the first half of a substep."""
        model, data, mujoco = self.model, self.data, self.mujoco
        mujoco.mj_step1(model, data)
        if self._has_grains and data.ncon and self._turn_friction():
            for compute in (
                mujoco.mj_makeConstraint,
                mujoco.mj_island,
                mujoco.mj_projectConstraint,
                mujoco.mj_referenceConstraint,
            ):
                compute(model, data)

    def _find_grains(self) -> None:
        """Read each geom's friction direction, if it has one, and its two friction coefficients."""
        model, grains = self.model, self._builder.shapes.grains
        self._grain_directions: NDArray[np.float64] = np.zeros((model.ngeom, 3))
        self._frictions: NDArray[np.float64] = np.repeat(model.geom_friction[:, :1], 2, axis=1)
        for index in range(model.ngeom) if grains else ():
            if (found := grains.get(model.geom(index).name)) is not None:
                self._grain_directions[index] = found.direction
                self._frictions[index] = (found.mu, found.mu2)
        self._has_grain: NDArray[np.bool_] = (self._grain_directions != 0).any(axis=1)
        self._has_grains = bool(self._has_grain.any())

    def _turn_friction(self) -> bool:
        """Align contact tangents with the friction directions and set both coefficients; return whether any contact changed.

        As in ODE, the smaller ``mu`` and the smaller ``mu2`` of the two geoms count. If both have a direction, that of the geom
        with the smaller ``mu`` counts. A direction along the normal is ignored: the contact keeps one coefficient.
        """
        contact = self.data.contact
        first, second = contact.geom.T
        uses_second = self._has_grain[second] & (
            ~self._has_grain[first] | (self._frictions[second, 0] < self._frictions[first, 0])
        )
        geoms = np.where(uses_second, second, first)
        axes = self.data.xmat[self.model.geom_bodyid[geoms]].reshape(-1, 3, 3)
        directions = np.einsum("nij,nj->ni", axes, self._grain_directions[geoms])
        normals = contact.frame[:, :3]
        tangents = directions - np.einsum("ni,ni->n", directions, normals)[:, None] * normals
        lengths = np.linalg.norm(tangents, axis=1)
        rows = np.flatnonzero(lengths > MIN_GRAIN)
        tangents = tangents[rows] / lengths[rows, None]
        contact.frame[rows, 3:6] = tangents
        contact.frame[rows, 6:9] = np.cross(normals[rows], tangents)
        both = np.minimum(self._frictions[first[rows]], self._frictions[second[rows]])
        contact.friction[rows, :2] = np.maximum(both, MIN_FRICTION)
        return bool(rows.size)

    def cast(
        self,
        origin: NDArray[np.float64],
        vectors: NDArray[np.float64],
        ids: NDArray[np.int32],
        distances: NDArray[np.float64],
        max_range: float,
        excluded_body: int,
    ) -> None:
        """Store the first geom that each ray hits, and its distance or -1. ``vectors``: (n, 3) unit vectors in world axes."""
        # Newer MuJoCo versions have an argument for normals.
        normals = (None,) if self._has_normals else ()
        # MuJoCo checks a body's first ``body_geomnum`` geoms for each ray. Exclude the contact geoms after them.
        # A room that is a single mesh has thousands of contact geoms.
        counts = self.model.body_geomnum
        all_counts = counts.copy()
        counts[:] = self._ray_counts
        try:
            self.mujoco.mj_multiRay(
                self.model,
                self.data,
                origin,
                vectors.ravel(),
                RAY_GROUPS,
                True,
                excluded_body,
                ids,
                distances,
                *normals,
                len(vectors),
                max_range,
            )
        finally:
            counts[:] = all_counts

    def _count_ray_geoms(self) -> NDArray[np.int32]:
        """Return the number of geoms per body that a ray must check: up to the last geom that rays can hit."""
        model = self.model
        counts = np.zeros(model.nbody, np.int32)
        geoms = np.flatnonzero(RAY_GROUPS[model.geom_group])
        bodies = model.geom_bodyid[geoms]
        np.maximum.at(counts, bodies, geoms - model.body_geomadr[bodies] + 1)
        return counts

    def geoms_within(self, point: NDArray[np.float64], distance: float) -> NDArray[np.intp]:
        """Return the geoms within a distance (m) of a point in the world."""
        radii = self.model.geom_rbound  # a radius of 0 means an infinite geom
        away = np.linalg.norm(self.data.geom_xpos - point, axis=1)
        return np.flatnonzero((radii > 0) & (away + radii < distance))

    def _coriolis_correction(self) -> NDArray[np.float64] | None:
        """Return the change in Coriolis and centrifugal forces from the last velocities to those half a step later.

        MuJoCo's velocities lag its positions by half a step. With forces of that time, a double pendulum loses a quarter of its
        energy in one minute; with this correction, it loses less than 0.1 %. Return None if joints are slow, or if an impact
        makes the extrapolation invalid.
        """
        data, swinging = self.data, self._swinging
        speed = abs(data.qvel[swinging]).max()
        if speed < MIN_SWING:
            return None
        change = data.qacc * self.substep
        if abs(change[swinging]).max() > 0.1 * speed:
            return None
        velocities = data.qvel.copy()
        forces = np.zeros(len(velocities))
        data.qvel[:] += 0.5 * change
        self.mujoco.mj_comVel(self.model, data)
        self.mujoco.mj_rne(self.model, data, 0, forces)
        data.qvel[:] = velocities
        self.mujoco.mj_comVel(self.model, data)
        correction: NDArray[np.float64] = data.qfrc_bias - forces
        return correction

    def _find_swinging(self) -> NDArray[np.intp]:
        """Return the degrees of freedom of hinge joints that turn an unbalanced mass, unlike wheels."""
        model = self.model
        result: list[int] = []
        for joint in np.flatnonzero(model.jnt_type == self.mujoco.mjtJoint.mjJNT_HINGE).tolist():
            body = int(model.jnt_bodyid[joint])
            dof = int(model.jnt_dofadr[joint])
            offset = model.body_ipos[body] - model.jnt_pos[joint]
            distance = np.linalg.norm(np.cross(offset, model.jnt_axis[joint]))
            if distance > 1e-3 or model.body_subtreemass[body] > 1.001 * model.body_mass[body]:
                result.append(dof)
        return np.array(result, np.intp)

    def _follow(self, left: int) -> None:
        """Set position motors' velocities so that they reach their targets in the last of ``left`` substeps."""
        dofs = self._followers
        lacking = self.target_position[dofs] - self.data.qpos[self._follower_positions]
        limit = self.max_velocity[dofs]
        self._bias[dofs] = np.clip(lacking / (left * self.substep), -limit, limit) * self._rate

    def _limit_damped(self) -> None:
        """Set the damping of damped joints with motors, and the maximum force of each of these motors.

        MuJoCo integrates damping implicitly: on a light wheel, this slows a motor for many steps, and the reaction pushes the
        robot back. As long as a motor is stronger than the damping, the damping is therefore included in the motor's force
        instead.
        """
        dofs, damping = self._damped, self.motor_damping[self._damped]
        velocity, limit = self.data.qvel[dofs], self.motor_limit[dofs]
        lost = abs(damping * velocity)
        is_strong = lost < limit
        target = self._bias[dofs] / self._rate
        brakes = velocity * (target - velocity) < 0
        self.motor_force[dofs] += np.where(self.model.dof_damping[dofs] > 0, 0.0, damping * velocity)
        self.model.dof_damping[dofs] = np.where(is_strong, 0.0, damping)
        left = limit + np.where(brakes, lost, -lost)
        self.model.dof_frictionloss[dofs] = np.where(is_strong, left, limit)

    def _record(self) -> None:
        """Save the step's contacts and forces before the next step overwrites them."""
        data = self.data
        contact = data.contact
        self.contacts = contact.geom.copy()
        self.contact_points = contact.pos.copy()
        self.contact_frames = contact.frame.copy()
        self.contact_depths = -contact.dist
        wrenches = np.zeros((data.ncon, 6))
        for index in range(data.ncon):
            self.mujoco.mj_contactForce(self.model, data, index, wrenches[index])
        self.contact_wrenches = wrenches
        self.mujoco.mj_rnePostConstraint(self.model, data)
        self.joint_wrenches = data.cfrc_int.copy()

    def _forget_details(self) -> None:
        self.contacts = np.zeros((0, 2), np.int32)
        self.contact_points = np.zeros((0, 3))
        self.contact_frames = np.zeros((0, 9))
        self.contact_depths = np.zeros(0)
        self.contact_wrenches = np.zeros((0, 6))
        self.joint_wrenches = np.zeros((self.model.nbody, 6))
