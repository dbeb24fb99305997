"""Tracks a description's adjustable joints. Pure: converts parameters to the values in a JointState.

Source: http://wiki.ros.org/joint_state_publisher. Like that node, it parses the description leniently: an incomplete
robot, or a COLLADA file, is accepted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from minirospy.base.errors import MinirospyError, UrdfError
from minirospy.core.urdf.elements import Element, parse_noted
from minirospy.core.urdf.values import NotANumberError, as_float

__all__ = [
    "Dependent",
    "FreeJoint",
    "JointError",
    "JointOptions",
    "JointStates",
    "StateValues",
    "read_joints",
]

_SETTLED = ("fixed", "floating", "planar")


class JointError(MinirospyError):
    """Raised if the joints cannot be determined. The message is one line with the joint and the reason."""


@dataclass
class FreeJoint:
    """An adjustable joint; positions are in radians or metres. None values are not published."""

    lower: float
    upper: float
    zero: float
    position: float | None = None
    velocity: float | None = None
    effort: float | None = None
    is_continuous: bool = False
    is_rising: bool = True

    def advance(self, step: float) -> None:
        """Move by ``step``, reversing at the limits. A continuous joint wraps around instead."""
        position = self.zero if self.position is None else self.position
        if self.is_rising:
            position += step
            if position > self.upper:
                position = self.lower if self.is_continuous else self.upper
                self.is_rising = self.is_continuous
        else:
            position -= step
            if position < self.lower:
                position, self.is_rising = self.lower, True
        self.position = position


@dataclass(frozen=True)
class Dependent:
    """A mimic joint: its position is ``factor * position of parent + offset``."""

    parent: str
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class JointOptions:
    """joint_state_publisher's parameters that select and configure joints. The fields have the parameters' names."""

    dependent_joints: Mapping[str, Dependent] = field(default_factory=dict)
    use_mimic_tags: bool = True
    use_smallest_joint_limits: bool = True
    zero: Callable[[str], float | None] = lambda _: None
    publish_default_positions: bool = True
    publish_default_velocities: bool = False
    publish_default_efforts: bool = False


@dataclass
class StateValues:
    """The lists in a JointState message: position, velocity and effort."""

    name: list[str]
    position: list[float]
    velocity: list[float]
    effort: list[float]


class JointStates:
    """The robot's joints, in the order of its description.

    ``free``: the joints that the user can move; all others mimic another joint.
    """

    def __init__(
        self, names: Sequence[str], free: dict[str, FreeJoint], dependent: Mapping[str, Dependent]
    ) -> None:
        self.names = names
        self.free = free
        self._rules = {name: self._rule(name, dependent) for name in names if name not in free}
        self._has_dependent = bool(dependent)

    def _rule(self, name: str, dependent: Mapping[str, Dependent]) -> Dependent:
        """Return the adjustable joint that a joint mimics, with factor and offset. Raise JointError if joints form a cycle."""
        if name not in dependent:
            # The joint was omitted because it has no limits: make it mimic the name "", which no joint has.
            return Dependent("")

        rule = dependent[name]
        chain = [name]
        while rule.parent in dependent:
            if rule.parent in chain:
                names = ", ".join(chain)
                raise JointError(f"Found an infinite recursive mimic chain: [{names}, {rule.parent}]")
            chain.append(rule.parent)
            above = dependent[rule.parent]
            rule = Dependent(
                above.parent, rule.factor * above.factor, rule.offset + rule.factor * above.offset
            )
        if rule.parent not in self.free:
            why = f"joint [{name}] depends on joint [{rule.parent}], which is not there or cannot be set"
            raise JointError(f"{why} (there are: {', '.join(self.free) or 'none'})")
        return rule

    def update(
        self,
        names: Sequence[str],
        positions: Sequence[float],
        velocities: Sequence[float],
        efforts: Sequence[float],
    ) -> None:
        """Set joints from another node's JointState. If a list is too short, the remaining joints keep their values."""
        for number, name in enumerate(names):
            joint = self.free.get(name)
            if joint is None:
                continue
            if number < len(positions):
                joint.position = positions[number]
            if number < len(velocities):
                joint.velocity = velocities[number]
            if number < len(efforts):
                joint.effort = efforts[number]

    def advance(self, step: float) -> None:
        """Move all adjustable joints by ``step``."""
        for joint in self.free.values():
            joint.advance(step)

    def values(self) -> StateValues:
        """Return the lists to publish. A list is empty if no joint has a value for it."""
        joints = self.free.values()
        has_position = self._has_dependent or any(joint.position is not None for joint in joints)
        has_velocity = any(joint.velocity is not None for joint in joints)
        has_effort = any(joint.effort is not None for joint in joints)
        found = StateValues([], [], [], [])
        for name in self.names:
            rule = self._rules.get(name) or Dependent(name)
            joint = self.free.get(rule.parent) or FreeJoint(0.0, 0.0, 0.0)
            found.name.append(name)
            if has_position:
                at = joint.position
                found.position.append(0.0 if at is None else at * rule.factor + rule.offset)
            if has_velocity:
                found.velocity.append((joint.velocity or 0.0) * rule.factor)
            if has_effort:
                found.effort.append(joint.effort or 0.0)
        return found


def read_joints(text: str, options: JointOptions, warn: Callable[[str], object]) -> JointStates:
    """Return a description's joints; call ``warn`` with a line for each omitted joint and each XML fault.

    Raise JointError if the description is invalid.
    """
    try:
        root, notes = parse_noted(text, "robot_description")
        for note in notes:
            warn(f"{note.text} (line {note.line})")
        if root.tag == "COLLADA":
            found = _collada_joints(root, warn)
            return JointStates([*found], found, options.dependent_joints)
        return _urdf_joints(root, options, warn)
    except UrdfError as error:
        raise JointError(str(error)) from error


def _urdf_joints(root: Element, options: JointOptions, warn: Callable[[str], object]) -> JointStates:
    names: list[str] = []
    free: dict[str, FreeJoint] = {}
    dependent = dict(options.dependent_joints)
    robots = [element for element in _below(root) if element.tag == "robot"]
    if not robots:
        raise UrdfError("robot_description", root.line, "Could not find the 'robot' element in the xml file")
    for element in robots[0].all("joint"):
        kind, name = element.attributes.get("type", ""), element.attributes.get("name", "")
        if kind in _SETTLED:
            continue
        names.append(name)
        limits = _limits(element, kind)
        if limits is None:
            warn(f"{name} is not fixed, nor continuous, but limits are not specified!")
            continue
        lower, upper = limits
        safety = [each for each in _below(element) if each.tag == "safety_controller"]
        if options.use_smallest_joint_limits and len(safety) == 1:
            lower = max(lower, _number(safety[0], "soft_lower_limit", lower))
            upper = min(upper, _number(safety[0], "soft_upper_limit", upper))

        mimics = [each for each in _below(element) if each.tag == "mimic"]
        if options.use_mimic_tags and len(mimics) == 1:
            mimic = mimics[0]
            factor, offset = _number(mimic, "multiplier", 1.0), _number(mimic, "offset", 0.0)
            dependent[name] = Dependent(mimic.attributes.get("joint", ""), factor, offset)
        elif name not in dependent:
            free[name] = _free_joint(name, lower, upper, kind, options)
    return JointStates(names, free, dependent)


def _free_joint(name: str, lower: float, upper: float, kind: str, options: JointOptions) -> FreeJoint:
    zero = options.zero(name) or ((upper + lower) / 2 if lower > 0 or upper < 0 else 0.0)
    return FreeJoint(
        lower,
        upper,
        zero,
        zero if options.publish_default_positions else None,
        0.0 if options.publish_default_velocities else None,
        0.0 if options.publish_default_efforts else None,
        kind == "continuous",
    )


def _limits(element: Element, kind: str) -> tuple[float, float] | None:
    """Return a joint's limits, or None if they are missing or not numbers."""
    if kind == "continuous":
        return -math.pi, math.pi
    for limit in _below(element):
        if limit.tag == "limit":
            try:
                lower, upper = limit.attributes.get("lower", ""), limit.attributes.get("upper", "")
                return as_float(lower), as_float(upper)
            except NotANumberError:
                return None
    return None


def _number(element: Element, name: str, default: float) -> float:
    text = element.attributes.get(name)
    if text is None:
        return default
    try:
        return as_float(text)
    except NotANumberError:
        why = f"{name} value ({text}) is not a valid float"
        raise UrdfError("robot_description", element.line, why) from None


def _below(element: Element) -> Iterator[Element]:
    """Yield an element and all its descendants, in document order."""
    yield element
    for child in element.children:
        yield from _below(child)


def _collada_joints(root: Element, warn: Callable[[str], object]) -> dict[str, FreeJoint]:
    """Return the revolute joints in a COLLADA description, whose limits are in degrees."""
    models = [each for each in _below(root) if each.tag == "kinematics_model"]
    techniques = [each for model in models[:1] for each in _below(model) if each.tag == "technique_common"]
    found = {}

    for element in (joint for technique in techniques[:1] for joint in technique.all("joint")):
        turning = [each for each in _below(element) if each.tag == "revolute"]
        if not turning:
            warn(f"Unknown joint type {element.attributes.get('name', '')}")
            continue
        texts = {each.tag: each.text for each in _below(turning[0])}
        try:
            lower, upper = as_float(texts.get("min", "")), as_float(texts.get("max", ""))
        except NotANumberError:
            raise UrdfError(
                "robot_description", element.line, "limits of a revolute joint are missing"
            ) from None
        if lower != upper:
            found[element.attributes.get("name", "")] = FreeJoint(
                math.radians(lower), math.radians(upper), 0.0, 0.0, 0.0, 0.0
            )
    return found
