"""A world in MuJoCo, built from the records of ``minirospy.core.sdf.model``.

A :class:`Simulation` is not thread-safe: it must be called from one thread at a time. On one machine, the same world, seed and
calls produce bit-identical states.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from minirospy.core.sdf.model import MIN_STEP, Axis, Model, Physics, Pose, Vector, World
from minirospy.core.sdf.poses import rotate
from minirospy.ros.gazebo_ros.physics.builder import Builder
from minirospy.ros.gazebo_ros.physics.engine import Engine
from minirospy.ros.gazebo_ros.physics.handles import SimModel
from minirospy.ros.gazebo_ros.physics.library import SimulationError
from minirospy.ros.gazebo_ros.physics.shapes import GROUP_CONTACT_ONLY, PART
from minirospy.ros.gazebo_ros.physics.states import Contact, LostModel, RayHits, Wrench

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics.rendering import Renderer

__all__ = ["Simulation"]

MAX_DISTANCE = 1e5  # m from the origin; models farther away are removed
MAX_SPEED = 1e5  # m/s or rad/s; faster models are unstable and are removed
NANOSECONDS = 1_000_000_000


class Simulation:
    """Simulates a world with MuJoCo."""

    def __init__(self, world: World | None = None, *, seed: int = 0) -> None:
        """Build the world. Raise SimulationError if MuJoCo is missing; invalid models are listed in ``warnings``."""
        world = world or World()
        self.world = world
        self.random = np.random.default_rng(seed)  # random generator for sensor noise
        self.warnings: list[str] = []
        self.forced: dict[str, None] = {}  # names of the models with applied forces
        self._had_forces = False
        self._time_ns = 0
        self._models: dict[str, SimModel] = {}
        self._builder = Builder(world.physics)
        self.engine = Engine(self._builder, world.physics)
        self._geom_names: list[str] = []
        self._model_of_dof: list[str] = []
        self._model_of_position: list[str] = []
        self._farthest: NDArray[np.float64] = np.zeros(0)  # limits of qpos; only free bodies have one
        self._add_all(world.models)

    # ---- time and steps

    @property
    def time(self) -> float:
        """Return the time in seconds."""
        return self._time_ns / NANOSECONDS

    @property
    def time_ns(self) -> int:
        """Return the time in nanoseconds: the exact sum of all steps."""
        return self._time_ns

    @property
    def physics(self) -> Physics:
        """Return the time step, gravity and other parameters."""
        return self.engine.physics

    def set_physics(self, physics: Physics) -> None:
        """Set the time step and gravity. Raise SimulationError if a value is not finite or the step is below 1 ns."""
        if not (
            MIN_STEP <= physics.step <= 1 and all(map(math.isfinite, (*physics.gravity, physics.update_rate)))
        ):
            raise SimulationError(
                "the step must be positive, from 1 ns to 1 s; gravity and update rate must be finite"
            )
        self.engine.set_physics(physics)

    @property
    def records_details(self) -> bool:
        """Return whether to record each step's contacts and joint wrenches, which takes time."""
        return self.engine.records_details

    @records_details.setter
    def records_details(self, value: bool) -> None:
        self.engine.records_details = value

    def step(self, count: int = 1) -> list[LostModel]:
        """Advance by a number of steps. Return the models removed for an invalid state or for leaving the world."""
        lost: list[LostModel] = []
        for _ in range(count):
            if self.forced or self._had_forces:
                self._apply_forces()
            for left in range(self.engine.substeps, 0, -1):
                lost += self._advance(left)
            self._time_ns += round(self.physics.step * NANOSECONDS)
            self.engine.data.time = self.time
        return lost

    def _advance(self, left: int) -> list[LostModel]:
        """Advance by the first of ``left`` substeps. Return the removed models."""
        engine = self.engine
        engine.refresh()
        positions, velocities = engine.data.qpos.copy(), engine.data.qvel.copy()
        engine.advance(left)
        # NaN and very large values also fail this comparison.
        data = engine.data
        if (abs(data.qvel) < MAX_SPEED).all() and (abs(data.qpos) < self._farthest).all():
            return []
        return self._remove_lost(positions, velocities)

    def _apply_forces(self) -> None:
        data = self.engine.data
        data.xfrc_applied[:] = 0
        data.qfrc_applied[:] = 0
        now = self.time
        self._had_forces = bool(self.forced)
        for name in list(self.forced):
            if not self._models[name].apply_forces(now):
                del self.forced[name]

    def _remove_lost(
        self, positions: NDArray[np.float64], velocities: NDArray[np.float64]
    ) -> list[LostModel]:
        """Remove the models that caused invalid states; restore all others to the state before the substep."""
        data = self.engine.data
        broken: dict[str, str] = {}
        fastest = np.full(len(data.qvel), MAX_SPEED)
        _find_lost(broken, data.qvel, fastest, "is faster than 100 km/s", self._model_of_dof)
        lost: dict[str, str] = {}
        _find_lost(lost, data.qpos, self._farthest, "is more than 100 km away", self._model_of_position)
        if broken:
            lost = {name: why for name, why in lost.items() if name not in broken and why != "became NaN"}
            lost |= {
                name: broken.get(name, "has too large a force") for name in self._sources(broken, velocities)
            }

        data.qpos[:], data.qvel[:] = positions, velocities
        data.qacc_warmstart[:] = 0
        self.engine.is_stale = True
        result = [LostModel(name, f"{reason}: removed") for name, reason in lost.items()]
        self._remove([each.name for each in result])
        return result

    def _sources(self, broken: Iterable[str], velocities: NDArray[np.float64]) -> list[str]:
        """Return the models that caused the last substep's invalid states. ``velocities`` are those before the substep.

        Contacts spread large velocities and NaN to other models. The source is the model whose velocity is too large even when
        computed without contacts. If there is none, it is the fastest of the invalid models.
        """
        with np.errstate(all="ignore"):
            free = abs(velocities + self.engine.data.qacc_smooth * self.engine.substep)
        speeds: dict[str, float] = {}
        for name, speed in zip(self._model_of_dof, free.tolist(), strict=True):
            speeds[name] = max(speeds.get(name, 0.0), math.inf if math.isnan(speed) else speed)
        sources = [name for name, speed in speeds.items() if speed >= MAX_SPEED]
        return sources or [max(broken, key=lambda name: speeds[name])]

    # ---- models

    @property
    def models(self) -> Mapping[str, SimModel]:
        """Return the models by name."""
        return self._models

    def model(self, name: str) -> SimModel:
        """Return a model. Raise SimulationError if it does not exist."""
        try:
            return self._models[name]
        except KeyError:
            raise SimulationError(f"there is no model '{name}'") from None

    def add_model(self, model: Model, pose: Pose | None = None, name: str = "") -> SimModel:
        """Add a model at ``pose`` (default: the pose in the model) and under ``name`` (default: the name in the model).

        The time and the other models' states are kept. Raise SimulationError if the name is in use or the model is invalid.
        """
        last = self._builder.shapes.last
        added = self._build(model, pose or model.pose, name or model.name)
        try:
            self.engine.recompile()
        except ValueError as error:
            self._drop(added)
            self._builder.shapes.delete_after(last)
            raise SimulationError(f"model '{added.name}': {_one_line(error)}") from error
        self._finish([added])
        return added

    def remove_model(self, name: str) -> None:
        """Remove a model; keep the time and the other models' states. Raise SimulationError if the model does not exist."""
        self.model(name)
        self._remove([name])

    def recompile(self) -> None:
        """Recompile the world after a change to the spec."""
        self.engine.recompile()
        self._bind()

    def set_axis(self, scoped: str, kind: str, axis: Axis) -> None:
        """Change a MuJoCo joint's limits and passive forces."""
        self._builder.set_axis(scoped, kind, axis)
        self.recompile()

    def _add_all(self, models: Iterable[Model]) -> None:
        """Add the world's models in one compilation or, if it fails, one by one."""
        added: list[SimModel] = []
        last = self._builder.shapes.last
        for model in models:
            try:
                added.append(self._build(model, model.pose, model.name))
            except SimulationError as error:
                self.warnings.append(str(error))
        try:
            self.engine.recompile()
        except ValueError:
            for each in added:
                self._drop(each)
            # Remove an invalid mesh: it would make every later compilation fail.
            self._builder.shapes.delete_after(last)
            for each in added:
                try:
                    self.add_model(each.record, each.start, each.name)
                except SimulationError as error:
                    self.warnings.append(str(error))
            return
        self._finish(added)

    def _build(self, model: Model, pose: Pose, name: str) -> SimModel:
        if name in self._models:
            raise SimulationError(f"there is a model '{name}' already")
        if not model.links:
            raise SimulationError(f"model '{name}' has no links")
        if not all(map(math.isfinite, (*pose.position, *pose.orientation))):
            raise SimulationError(f"model '{name}': the pose is not finite")
        last = self._builder.shapes.last
        try:
            built = self._builder.add(model, name, pose)
        except Exception:
            self._builder.shapes.delete_after(last)
            raise
        self.warnings += self._builder.take_warnings(name)
        if self._builder.has_visuals:
            self.warnings += self._builder.add_visuals(built, model, name)
        added = SimModel(self, name, model, pose, built)
        self._models[name] = added
        return added

    def _drop(self, model: SimModel) -> None:
        self._builder.delete(model.built)
        del self._models[model.name]
        self.forced.pop(model.name, None)

    def _finish(self, added: list[SimModel]) -> None:
        self._bind()
        for model in added:
            for joint in model.all_joints():
                if joint.axis.initial_position:
                    joint.set_state(joint.axis.initial_position)
            if any(link.has_damping for link in model.links.values()):
                self.forced[model.name] = None

    def _remove(self, names: list[str]) -> None:
        for name in names:
            self._drop(self._models[name])
        self.engine.recompile()
        self._bind()

    def _bind(self) -> None:
        for model in self._models.values():
            model.bind()
        model = self.engine.model
        self._geom_names = [model.geom(index).name.partition(PART)[0] for index in range(model.ngeom)]
        owners = {link.id: name for name, each in self._models.items() for link in each.links.values()}
        assert len(owners) == model.nbody - 1
        self._model_of_dof = [owners[int(body)] for body in model.dof_bodyid]
        joints = [owners[int(body)] for body in model.jnt_bodyid]
        self._farthest = np.full(model.nq, np.inf)
        for joint in np.flatnonzero(model.jnt_type == 0):  # free bodies
            address = int(model.jnt_qposadr[joint])
            self._farthest[address : address + 3] = MAX_DISTANCE
        starts = [int(address) for address in model.jnt_qposadr] + [model.nq]
        self._model_of_position = [
            joints[index] for index in range(len(joints)) for _ in range(starts[index], starts[index + 1])
        ]

    # ---- resets

    def reset_models(self) -> None:
        """Return all models to rest at their initial poses and joint positions. The time continues."""
        for model in self._models.values():
            model.reset()
        self.engine.data.qacc_warmstart[:] = 0

    def reset(self) -> None:
        """Reset the models and the time."""
        self._time_ns = 0
        self.engine.data.time = 0.0
        self.reset_models()

    # ---- sensing

    def cast_rays(
        self,
        pose: Pose,
        directions: NDArray[np.float64],
        max_range: float,
        *,
        min_range: float = 0.0,
        exclude: str = "",
    ) -> RayHits:
        """Cast rays from a pose's origin; ``directions`` are (n, 3) unit vectors in the pose's frame.

        Rays start at ``min_range``, so that anything closer, such as the sensor's own housing, does not stop them. ``exclude`` is
        a link (``model::link``) whose collisions are ignored.
        """
        engine = self.engine
        engine.refresh()
        count = len(directions)
        ids = np.full(count, -1, np.int32)
        distances = np.full(count, -1.0)
        if count:
            origin = np.array(pose.position)
            vectors = np.ascontiguousarray(directions @ _matrix(pose).T)
            body = engine.model.body(exclude).id if exclude else -1
            # MuJoCo casts many rays only from one point, so hide geoms entirely within the minimum range (the housing).
            inner = engine.geoms_within(origin, min_range)
            groups = engine.model.geom_group
            shown = groups[inner]
            groups[inner] = GROUP_CONTACT_ONLY
            engine.cast(origin, vectors, ids, distances, max_range, body)
            groups[inner] = shown
            # If a ray hits another geom closer than this, such as a wall, cast the ray again from the minimum range.
            for index in np.flatnonzero((distances >= 0) & (distances < min_range)).tolist():
                start = origin + min_range * vectors[index]
                found, hit = np.full(1, -1, np.int32), np.full(1, -1.0)
                engine.cast(start, vectors[index : index + 1].copy(), found, hit, max_range - min_range, body)
                ids[index] = found[0]
                distances[index] = hit[0] + min_range if hit[0] >= 0 else -1.0
        missed = (distances < 0) | (distances > max_range)
        distances[missed] = np.inf
        ids[missed] = -1
        names = self._geom_names
        return RayHits(distances, tuple(names[each] if each >= 0 else "" for each in ids.tolist()))

    def renderer(self, width: int, height: int) -> Renderer:
        """Return a renderer for the calling thread. Raise SimulationError if OpenGL or a library is missing.

        The first call adds the visuals to the compiled world, which takes time and memory.
        """
        renderer = self.open_renderer(width, height)
        self.add_visuals()
        return renderer

    def open_renderer(self, width: int, height: int) -> Renderer:
        """Return a renderer for the calling thread, which can be any thread. The caller must first call :meth:`add_visuals`.

        Raise SimulationError if OpenGL or a library is missing.
        """
        from minirospy.ros.gazebo_ros.physics.rendering import Renderer

        return Renderer(self.engine, width, height)

    def add_visuals(self) -> None:
        """Add visuals and lights for cameras, also for models added later."""
        if self._builder.has_visuals:
            return
        self._builder.add_scene(self.world)
        last = self._builder.shapes.last
        for model in self._models.values():
            self.warnings += self._builder.add_visuals(model.built, model.record, model.name)
        try:
            self.engine.recompile()
        except ValueError:
            self._delete_visuals(self._models.values(), last)
            self._add_visuals_one_by_one()
        self._bind()

    def _add_visuals_one_by_one(self) -> None:
        """Add each model's visuals if MuJoCo accepts them; otherwise add a line to ``warnings``."""
        for model in self._models.values():
            last = self._builder.shapes.last
            self._builder.add_visuals(model.built, model.record, model.name)  # already in `warnings`
            try:
                self.engine.recompile()
            except ValueError as error:
                self.warnings.append(f"model '{model.name}' is not shown: {_one_line(error)}")
                self._delete_visuals([model], last)
        self.engine.recompile()

    def _delete_visuals(self, models: Iterable[SimModel], last: int) -> None:
        for model in models:
            self._builder.delete_visuals(model.built)
        self._builder.shapes.delete_after(last)

    def body_poses(self) -> NDArray[np.float64]:
        """Return the links' world poses (n, 7): position and orientation (x, y, z, w), indexed by link id."""
        self.engine.refresh()
        data = self.engine.data
        return np.concatenate((data.xpos, data.xquat[:, (1, 2, 3, 0)]), axis=1)

    def contact_points(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the contact points and unit normals in world coordinates, both (n, 3)."""
        self.engine.refresh()
        contact = self.engine.data.contact
        touching = contact.dist <= 0
        return contact.pos[touching].copy(), contact.frame[touching, :3].copy()

    def contacts(self) -> list[Contact]:
        """Return the last step's contacts, which are recorded if ``records_details`` was set before the step."""
        engine = self.engine
        pairs: dict[tuple[str, str], list[int]] = {}
        for index, (first, second) in enumerate(engine.contacts.tolist()):
            if first >= 0 and second >= 0:
                pairs.setdefault((self._geom_names[first], self._geom_names[second]), []).append(index)
        return [self._contact(first, second, rows) for (first, second), rows in pairs.items()]

    def _contact(self, first: str, second: str, rows: list[int]) -> Contact:
        engine = self.engine
        # MuJoCo's normals point from the first geom to the second; its forces act on the second.
        frames = engine.contact_frames[rows].reshape(-1, 3, 3)
        local = engine.contact_wrenches[rows].reshape(-1, 2, 3)
        wrenches = -np.einsum("nij,nki->nkj", frames, local)
        return Contact(
            first,
            second,
            tuple((x, y, z) for x, y, z in engine.contact_points[rows].tolist()),
            tuple((-x, -y, -z) for x, y, z in frames[:, 0].tolist()),
            tuple(engine.contact_depths[rows].tolist()),
            tuple(Wrench(_vector(force), _vector(torque)) for force, torque in wrenches.tolist()),
        )


def _find_lost(
    lost: dict[str, str],
    values: NDArray[np.float64],
    limits: NDArray[np.float64],
    reason: str,
    owners: list[str],
) -> None:
    for index in np.flatnonzero(~(abs(values) < limits)):
        why = reason if math.isfinite(values[index]) else "became NaN"
        lost.setdefault(owners[index], why)


def _vector(values: list[float]) -> Vector:
    x, y, z = values
    return x, y, z


def _matrix(pose: Pose) -> NDArray[np.float64]:
    """Return the rotation matrix of a pose."""
    columns = [rotate(pose.orientation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    return np.transpose(np.array(columns))


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
