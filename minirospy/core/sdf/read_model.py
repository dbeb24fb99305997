"""Read ``<model>`` elements of SDF 1.4 to 1.7. Nested models are flattened: their parts are named ``nested::part``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import TypeVar

from minirospy.core.sdf.frames import MODEL, Frame, FrameError, Frames
from minirospy.core.sdf.includes import Included, open_include
from minirospy.core.sdf.model import (
    IDENTITY,
    Joint,
    Link,
    Mimic,
    Model,
    Plugin,
    Pose,
    Vector,
)
from minirospy.core.sdf.parts import (
    read_axis,
    read_inertial,
    read_light,
    read_mimic,
    read_plugins,
    read_sensor,
)
from minirospy.core.sdf.poses import compose, relative, rotate, rotate_back
from minirospy.core.sdf.shapes import read_collision, read_visual
from minirospy.core.sdf.source import Source
from minirospy.core.sdf.text import Element

__all__ = ["read_included_model", "read_model"]

_Part = TypeVar("_Part")

_WORLD = "world"
_KINDS = {
    "revolute": "revolute",
    "continuous": "continuous",
    "prismatic": "prismatic",
    "fixed": "fixed",
    "ball": "ball",
    "universal": "universal",
    "revolute2": "universal",
}
_APPROXIMATED = {"screw": "prismatic"}
_NOT_BUILT = ("projector", "audio_source", "particle_emitter")


def read_model(element: Element, source: Source, name: str = "", is_static: bool | None = None) -> Model:
    """Read a model. ``name`` and ``is_static`` replace the model's own values if given.

    Its pose must not be relative to a frame. Raise SdfError if the model is unusable.
    """
    source = replace(source, warnings=[])
    reader = _Reader(element, source, name or source.name(element), is_static)
    model = reader.read()
    return replace(model, pose=source.pose_of(element), warnings=tuple(source.warnings))


def read_included_model(included: Included, source: Source) -> Model:
    """Read a model referred to by ``<include>``, with the element's name, pose, static flag and plugins.

    Raise SdfError if the model is unusable.
    """
    model = read_model(included.entity, included.source, included.name, included.is_static)
    return replace(
        model,
        pose=source.pose_of(included.element, model.pose),
        plugins=model.plugins + read_plugins(included.element, source),
    )


@dataclass
class _Nested:
    """A nested model: its own name, its pose element and its parts."""

    name: str
    pose: Element | None
    model: Model
    plugins: tuple[Plugin, ...] = ()


@dataclass
class _Reader:
    """The state while reading one model.

    element, source, name, static: those of the model. links, joints: elements by name. nested: models by name. frames: the frames
    of all of these. attached: for each ``<frame>``, the frame or link to which it is attached.
    """

    element: Element
    source: Source
    name: str
    static: bool | None
    links: dict[str, Element] = field(default_factory=dict)
    joints: dict[str, Element] = field(default_factory=dict)
    nested: dict[str, _Nested] = field(default_factory=dict)
    attached: dict[str, str] = field(default_factory=dict)
    frames: Frames = field(default_factory=lambda: Frames({}))

    def read(self) -> Model:
        source, element = self.source, self.element
        is_static = bool(self._own_static()) if self.static is None else self.static
        self.static = is_static
        self._collect()
        frames: dict[str, Frame] = {}
        for name, frame in self._all_frames():
            frames.setdefault(name, frame)  # a name that a link and a joint share refers to the link
        self.frames = Frames(frames)
        self_collide = source.flag(element, "self_collide", False)

        links = {name: self._link(name, part, self_collide) for name, part in self.links.items()}
        joints: dict[str, Joint] = {}
        plugins = read_plugins(element, source)
        for nested in self.nested.values():
            pose = self._in_model(nested.name, element)
            for link in nested.model.links.values():
                name = f"{nested.name}::{link.name}"
                links[name] = replace(link, name=name, pose=compose(pose, link.pose))
            joints.update(_prefixed_joints(nested))
            plugins += nested.model.plugins + nested.plugins
        for name, part in self.joints.items():
            joint = self._joint(name, part, links)
            if joint is not None:
                joints[name] = joint

        if not links:
            raise source.error(element, f"model [{self.name}] has no links")
        return Model(self.name, links, joints, IDENTITY, is_static, self_collide, plugins)

    # ---- names, parts and included models

    def _own_static(self) -> bool | None:
        """Return the first ``<static>`` of the model and the models that it includes, or None if there is none.

        sdformat moves the children of an included model, including ``<static>``, into the including model.
        """
        for child in self.element.children:
            if child.tag == "static":
                return self.source.flag(self.element, "static", False)
            if child.tag != "include":
                continue
            self.source.count(child)
            if (found := self._find_include(child)) is not None:
                inner = _Reader(found.entity, found.source, found.name, None)
                is_static = inner._own_static() if found.is_static is None else found.is_static
                if is_static is not None:
                    return is_static
        return None

    def _find_include(self, child: Element) -> Included | None:
        """Return the model that an ``<include>`` refers to, or None if there is none."""
        uri = self.source.text(child, "uri")
        if uri and self.source.find(uri) is None:
            return None
        included = open_include(child, self.source.inside(child))
        return included if included is not None and included.entity.tag == "model" else None

    def _collect(self) -> None:
        source = self.source
        source.count(self.element)
        for child in self.element.children:
            if child.tag == "link":
                self._add(self.links, child)
            elif child.tag == "joint":
                self._add(self.joints, child)
            elif child.tag == "model":
                inner = _Reader(child, source.inside(child), source.name(child), self.static)
                self._nest(_Nested(inner.name, child.first("pose"), inner.read()), child)
            elif child.tag == "include":
                self._include(child)
            elif child.tag in ("gripper", "road", "population"):
                source.warn(child, f"<{child.tag}> of model [{self.name}] is not simulated")

    def _add(self, parts: dict[str, Element], child: Element) -> None:
        name = self.source.name(child)
        self.source.count(child)
        if name in parts:
            self.source.warn(child, f"there are two {child.tag}s [{name}]: the second is left out")
            return
        parts[name] = child

    def _include(self, child: Element) -> None:
        source = self.source
        uri = source.text(child, "uri")
        if uri and source.find(uri) is None:
            source.warn(child, f"{uri} does not exist, and is left out of model [{self.name}]")
            return
        included = self._find_include(child)
        if included is None:
            source.warn(
                child, f"{source.text(child, 'uri')} has no model, and is left out of model [{self.name}]"
            )
            return
        name = included.name or included.source.name(included.entity)
        inner = _Reader(included.entity, included.source, name, self.static)
        pose = child.first("pose") or included.entity.first("pose")
        self._nest(_Nested(name, pose, inner.read(), read_plugins(child, source)), child)

    def _nest(self, nested: _Nested, child: Element) -> None:
        if nested.name in self.nested:
            self.source.warn(child, f"there are two models [{nested.name}]: the second is left out")
            return
        self.nested[nested.name] = nested

    # ---- frames

    def _all_frames(self) -> Iterator[tuple[str, Frame]]:
        for name, part in self.links.items():
            yield name, self._frame(part, MODEL)
        for name, part in self.joints.items():
            child = self.source.text(part, "child")
            frame = self._frame(part, MODEL if child == _WORLD else child)
            yield _joint_key(name), frame
            yield name, frame
        for part in self.element.all("frame"):
            name = self.source.name(part)
            self.attached[name] = part.attributes.get("attached_to", "").strip()
            yield name, self._frame(part, self.attached[name] or MODEL)
        for name, nested in self.nested.items():
            yield name, Frame(*self._placed(nested.pose, MODEL))
            for link in nested.model.links.values():
                yield f"{name}::{link.name}", Frame(name, link.pose)
            for joint in nested.model.joints.values():
                child = MODEL if joint.child == _WORLD else f"{name}::{joint.child}"
                yield f"{name}::{joint.name}", Frame(child, joint.pose)

    def _frame(self, part: Element, default: str) -> Frame:
        return Frame(*self._placed(part.first("pose"), default))

    def _placed(self, pose: Element | None, default: str) -> tuple[str, Pose]:
        """Return the frame that a ``<pose>`` refers to (or ``default``), and the pose in that frame."""
        if pose is None:
            return default, IDENTITY
        return self._reference(pose) or default, self.source.pose(pose)

    def _reference(self, pose: Element) -> str:
        """Return the frame name in a pose's attributes. In SDF 1.5 and 1.6, an unknown frame has no effect."""
        name = pose.attributes.get("relative_to", "").strip()
        if name:
            return MODEL if name == _WORLD else name
        name = pose.attributes.get("frame", "").strip()
        return name if name in self.links or name in self.joints or name in self.nested else ""

    def _in_model(self, name: str, element: Element) -> Pose:
        try:
            return self.frames.in_model(name)
        except FrameError as error:
            raise self.source.error(element, f"model [{self.name}]: {error}") from None

    def _in_link(self, part: Element, link: str) -> Pose:
        """Return a link part's pose relative to the link."""
        frame, value = self._placed(part.first("pose"), link)
        try:
            return self.frames.relative(value, frame, link)
        except FrameError as error:
            raise self.source.error(part, f"model [{self.name}]: {error}") from None

    # ---- parts

    def _link(self, name: str, element: Element, self_collide: bool) -> Link:
        source, static = self.source, bool(self.static)
        for child in element.children:
            if child.tag in _NOT_BUILT:
                source.warn(child, f"<{child.tag}> of link [{name}] is not simulated")
            elif child.tag == "plugin":
                source.warn(
                    child,
                    f"plugin [{child.attributes.get('name', '')}] of link [{name}] is left out: "
                    "Gazebo loads plugins of models and sensors only",
                )
        decay = element.first("velocity_decay")

        def pose_of(part: Element) -> Pose:
            return self._in_link(part, name)

        return Link(
            name,
            self._in_model(name, element),
            read_inertial(element, source, static, pose_of),
            self._parts(element, "collision", read_collision, pose_of),
            self._parts(element, "visual", read_visual, pose_of),
            self._parts(element, "sensor", read_sensor, pose_of),
            self._parts(element, "light", read_light, pose_of),
            source.flag(element, "gravity", True),
            source.flag(element, "self_collide", self_collide),
            source.amount(decay, "linear", 0.0),
            source.amount(decay, "angular", 0.0),
        )

    def _parts(
        self,
        element: Element,
        tag: str,
        read: Callable[[Element, Pose, Source], _Part | None],
        pose_of: Callable[[Element], Pose],
    ) -> tuple[_Part, ...]:
        """Return the results of ``read`` for the children with this tag, except those that are None."""
        parts = (read(part, pose_of(part), self.source) for part in element.all(tag))
        return tuple(part for part in parts if part is not None)

    # ---- joints

    def _joint(self, name: str, element: Element, links: dict[str, Link]) -> Joint | None:
        source = self.source
        kind = self._kind(name, element)
        if kind is None:
            return None
        parent, child = (self._link_of(source.text(element, tag)) for tag in ("parent", "child"))
        for tag, link in (("parent", parent), ("child", child)):
            if link not in links and link != _WORLD:
                source.warn(element, f"joint [{name}] is left out: its {tag} link [{link}] does not exist")
                return None
        if parent == child:
            source.warn(element, f"joint [{name}] is left out: parent and child are both [{child}]")
            return None

        here = self._in_model(_joint_key(name), element)
        axis_element = element.first("axis")
        axis, axis2 = (
            read_axis(element.first(tag), source, self._turner(here, element)) for tag in ("axis", "axis2")
        )
        initial = source.number(element, "initial_joint_position", axis.initial_position)
        axis = axis._replace(initial_position=initial)
        if child == _WORLD:
            # MuJoCo and Gazebo move a joint's child, so make the world the parent, and reverse the axis.
            parent, child = child, parent
            axis, axis2 = (each._replace(xyz=_negative(each.xyz)) for each in (axis, axis2))
        pose = relative(links[child].pose, here)
        sensors = self._parts(element, "sensor", read_sensor, source.pose_of)
        return Joint(name, kind, parent, child, pose, axis, axis2, read_mimic(axis_element, source), sensors)

    def _kind(self, name: str, element: Element) -> str | None:
        text = element.attributes.get("type", "").strip()
        if text in _APPROXIMATED:
            self.source.warn(element, f"joint [{name}]: {text} is simulated as {_APPROXIMATED[text]}")
            return _APPROXIMATED[text]
        if text not in _KINDS:
            self.source.warn(element, f"joint [{name}] is left out: its type '{text}' is not supported")
        return _KINDS.get(text)

    def _link_of(self, name: str) -> str:
        """Return the link for a name in a joint: the name may be that of a frame, which is attached to a link."""
        for _ in range(len(self.attached) + 1):
            if name not in self.attached or name in self.links:
                break
            name = self.attached[name]
        return name

    def _turner(self, joint: Pose, element: Element) -> Callable[[Element, Vector], Vector]:
        """Return a function that converts an axis to the joint's frame. Before SDF 1.5, axes are in the model's frame."""

        def turned(axis: Element, xyz: Vector) -> Vector:
            part = axis.first("xyz")
            frame = part.attributes.get("expressed_in", "").strip() if part is not None else ""
            is_in_model = self.source.flag(axis, "use_parent_model_frame", self.source.version < (1, 5))
            if frame:
                xyz = rotate(self._in_model(MODEL if frame == _WORLD else frame, element).orientation, xyz)
            elif not is_in_model:
                return xyz
            return rotate_back(joint.orientation, xyz)

        return turned


def _joint_key(name: str) -> str:
    """Return the key of a joint's frame; it contains a newline, which no frame name does."""
    return f"joint\n{name}"


def _negative(vector: Vector) -> Vector:
    x, y, z = vector
    return -x, -y, -z


def _prefixed_joints(nested: _Nested) -> Iterator[tuple[str, Joint]]:
    def prefixed(link: str) -> str:
        return link if link == _WORLD else f"{nested.name}::{link}"

    for joint in nested.model.joints.values():
        mimic = joint.mimic
        if mimic is not None:
            mimic = Mimic(f"{nested.name}::{mimic.joint}", mimic.multiplier, mimic.offset)
        name = f"{nested.name}::{joint.name}"
        yield (
            name,
            replace(
                joint, name=name, parent=prefixed(joint.parent), child=prefixed(joint.child), mimic=mimic
            ),
        )
