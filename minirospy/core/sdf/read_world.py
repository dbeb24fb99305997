"""Read ``<world>`` elements of SDF 1.4 to 1.7. Skip unusable models, and read the rest of the world."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

from minirospy.base.errors import SdfError
from minirospy.core.sdf.includes import open_include
from minirospy.core.sdf.model import (
    MIN_STEP,
    Color,
    Light,
    Model,
    Physics,
    Plugin,
    Pose,
    World,
)
from minirospy.core.sdf.parts import read_light, read_plugin
from minirospy.core.sdf.read_model import read_included_model, read_model
from minirospy.core.sdf.source import Source
from minirospy.core.sdf.text import Element

__all__ = ["read_physics", "read_world"]

_PHYSICS = Physics()
_NOT_SIMULATED = ("actor", "population", "road", "joint", "gripper")


def read_world(element: Element, source: Source) -> World:
    """Read a ``<world>``, or an ``<sdf>`` that contains only models and lights."""
    reader = _Reader(source)
    for child in element.children:
        reader.read(child)
    for state in element.all("state"):
        reader.apply(state)
    return World(
        element.attributes.get("name", "") or "default",
        tuple(reader.models),
        tuple(reader.lights),
        reader.physics(element),
        tuple(reader.plugins),
        reader.ambient,
        reader.background,
        reader.camera,
        tuple(source.warnings),
    )


def read_physics(element: Element | None, source: Source) -> Physics:
    """Read ``<physics>``. Without it, use Gazebo's defaults."""
    ode = element.first("ode") if element is not None else None
    solver = ode.first("solver") if ode is not None else None
    step = source.number(element, "max_step_size", _PHYSICS.step)
    if not MIN_STEP <= step < 1.0:
        source.warn(element, f"the step of {step:g} s is not possible: it is {_PHYSICS.step} s")
        step = _PHYSICS.step
    return Physics(
        step,
        source.number(element, "real_time_factor", _PHYSICS.real_time_factor),
        source.amount(element, "real_time_update_rate", _PHYSICS.update_rate),
        source.vector(element, "gravity", _PHYSICS.gravity),
        int(source.number(solver, "iters", _PHYSICS.iterations)),
        source.number(solver, "sor", _PHYSICS.sor),
        int(source.number(element, "max_contacts", _PHYSICS.max_contacts)),
    )


@dataclass
class _Reader:
    """The parts of one world that have been read so far."""

    source: Source
    models: list[Model] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    plugins: list[Plugin] = field(default_factory=list)
    names: set[str] = field(default_factory=set)
    numbers: dict[str, Iterator[int]] = field(
        default_factory=dict
    )  # for each repeated name, the numbers to append to it
    ambient: Color = World.ambient
    background: Color = World.background
    camera: Pose | None = None

    def read(self, child: Element) -> None:
        """Read one child element of the world."""
        reader: Callable[[Element], None] | None = {
            "model": self._model,
            "include": self._include,
            "light": self._light,
            "plugin": self._plugin,
            "scene": self._scene,
            "gui": self._gui,
        }.get(child.tag)
        if reader is None:
            if child.tag in _NOT_SIMULATED:
                self.source.warn(child, f"{_title(child)} is not simulated")
            return
        if self.source.shared.is_full and child.tag in ("model", "include"):
            self.source.warn(None, "the models after it are left out, too")
            return
        try:
            reader(child)
        except SdfError as error:
            self.source.warnings.append(f"{_title(child)} is left out: {error}")

    def physics(self, world: Element) -> Physics:
        """Return the engine's parameters: the default ``<physics>``, else the first one."""
        profiles = list(world.all("physics"))
        chosen = next(
            (each for each in profiles if each.attributes.get("default", "") in ("1", "true")), None
        )
        try:
            physics = read_physics(chosen or (profiles[0] if profiles else None), self.source)
            # Prefer the world's ``<gravity>``, which replaces that of ``<physics>`` since SDF 1.6.
            return physics._replace(gravity=self.source.vector(world, "gravity", physics.gravity))
        except SdfError as error:
            self.source.warnings.append(f"physics has its default values: {error}")
            return _PHYSICS

    def apply(self, state: Element) -> None:
        """Move models and lights to their poses in ``<state>``, remove its deletions, and read its insertions."""
        poses = {
            kind: {part.attributes.get("name", ""): part for part in state.all(kind)}
            for kind in ("model", "light")
        }
        deletions = state.first("deletions")
        deleted = {part.text.strip() for part in deletions.children} if deletions is not None else set()
        self.models = [
            replace(model, pose=self._state_pose(poses["model"].get(model.name), model.pose))
            for model in self.models
            if model.name not in deleted
        ]
        self.lights = [
            light._replace(pose=self._state_pose(poses["light"].get(light.name), light.pose))
            for light in self.lights
            if light.name not in deleted
        ]
        insertions = state.first("insertions")
        for child in insertions.children if insertions is not None else ():
            self.read(child)

    # ---- children

    def _model(self, child: Element) -> None:
        self._add(read_model(child, self.source), child)

    def _include(self, child: Element) -> None:
        source = self.source
        included = open_include(child, source)
        if included is None:
            raise source.error(child, "the file has no model")
        if included.entity.tag == "model":
            self._add(read_included_model(included, source), child)
        elif included.entity.tag == "light":
            pose = source.pose_of(child if child.first("pose") is not None else included.entity)
            light = read_light(included.entity, pose, included.source)
            self._add_light(light._replace(name=included.name or light.name), child)
        else:
            source.warn(child, f"{_title(child)}: <{included.entity.tag}> is not simulated")

    def _add(self, model: Model, child: Element) -> None:
        name = self._unused(model.name, child)
        self.models.append(replace(model, name=name))

    def _light(self, child: Element) -> None:
        self._add_light(read_light(child, self.source.pose_of(child), self.source), child)

    def _add_light(self, light: Light, child: Element) -> None:
        self.lights.append(light._replace(name=self._unused(light.name, child)))

    def _unused(self, name: str, child: Element) -> str:
        """Return a name that no other model or light has, by appending a number as Gazebo does."""
        unused = name
        if name in self.names:
            numbers = self.numbers.setdefault(name, itertools.count())
            unused = next(each for number in numbers if (each := f"{name}_{number}") not in self.names)
            self.source.warn(child, f"[{name}] exists already: this one is [{unused}]")
        self.names.add(unused)
        return unused

    def _plugin(self, child: Element) -> None:
        plugin = read_plugin(child, self.source)
        if plugin is not None:
            self.plugins.append(plugin)

    def _scene(self, child: Element) -> None:
        self.ambient = self.source.color(child, "ambient", self.ambient) or self.ambient
        self.background = self.source.color(child, "background", self.background) or self.background

    def _gui(self, child: Element) -> None:
        camera = child.first("camera")
        pose = camera.first("pose") if camera is not None else None
        if pose is not None:
            self.camera = self.source.pose(pose)

    def _state_pose(self, part: Element | None, default: Pose) -> Pose:
        try:
            return default if part is None else self.source.pose_of(part, default)
        except SdfError as error:
            self.source.warnings.append(f"a pose in <state> is not used: {error}")
            return default


def _title(child: Element) -> str:
    name = child.attributes.get("name", "")
    if not name and child.tag == "include":
        uri = child.first("uri")
        given = child.first("name")
        name = (given or uri or child).text.strip()
    return f"{child.tag} [{name}]" if name else f"<{child.tag}>"
