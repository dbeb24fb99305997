"""Read ``<joint>`` and its contents from elements."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from minirospy.core.urdf.elements import Element
from minirospy.core.urdf.links import ElementError, read_origin
from minirospy.core.urdf.model import (
    Calibration,
    Dynamics,
    Joint,
    JointType,
    Limit,
    Mimic,
    Origin,
    Safety,
    Vector,
)
from minirospy.core.urdf.values import NotANumberError, as_float, parse_vector

__all__ = ["read_joint"]

_T = TypeVar("_T")
_TYPES = {type_.value: type_ for type_ in JointType}
_NO_LIMITS = {
    JointType.REVOLUTE: "is of type REVOLUTE but it does not specify limits",
    JointType.PRISMATIC: "is of type PRISMATIC without limits",
}
_IMMOBILE = (JointType.FIXED, JointType.FLOATING)


def read_joint(element: Element) -> Joint:
    """Parse a ``<joint>`` element. Raise ElementError if it is invalid."""
    name = element.attributes.get("name")
    if name is None:
        raise ElementError(element.line, "unnamed joint found")
    origin = _read_joint_origin(element, name)
    type_ = _read_type(element, name)
    axis = (1.0, 0.0, 0.0) if type_ in _IMMOBILE else _read_axis(element, name)

    limit = _part(element, "limit", _read_limit, f"Could not parse limit element for joint [{name}]")
    if limit is None and type_ in _NO_LIMITS:
        raise ElementError(element.line, f"Joint [{name}] {_NO_LIMITS[type_]}")
    # Some messages contain two spaces, as in ROS's parser.
    safety = _part(
        element, "safety_controller", _read_safety, f"Could not parse safety element for joint [{name}]"
    )
    calibration = _part(
        element, "calibration", _read_calibration, f"Could not parse calibration element for joint  [{name}]"
    )
    mimic = _part(element, "mimic", _read_mimic, f"Could not parse mimic element for joint  [{name}]")
    dynamics = _part(
        element, "dynamics", _read_dynamics, f"Could not parse joint_dynamics element for joint [{name}]"
    )
    return Joint(
        name,
        type_,
        _link_of(element, "parent"),
        _link_of(element, "child"),
        origin,
        axis,
        element.line,
        limit,
        mimic,
        safety,
        calibration,
        dynamics,
    )


def _read_joint_origin(element: Element, name: str) -> Origin:
    try:
        return read_origin(element)
    except ElementError as error:
        why = f"Malformed parent origin element for joint [{name}]"
        raise ElementError(error.line, *error.trail, why) from None


def _read_type(element: Element, name: str) -> JointType:
    text = element.attributes.get("type")
    if text is None:
        raise ElementError(element.line, f"joint [{name}] has no type, check to see if it's a reference.")
    if text not in _TYPES:
        raise ElementError(element.line, f"Joint [{name}] has no known type [{text}]")
    return _TYPES[text]


def _read_axis(element: Element, name: str) -> Vector:
    axis = element.first("axis")
    if axis is None or "xyz" not in axis.attributes:
        return (1.0, 0.0, 0.0)
    try:
        return parse_vector(axis.attributes["xyz"])
    except NotANumberError as error:
        raise ElementError(axis.line, f"Malformed axis element for joint [{name}]: {error}") from None


def _link_of(element: Element, tag: str) -> str:
    part = element.first(tag)
    return part.attributes.get("link", "") if part else ""


def _part(element: Element, tag: str, read: Callable[[Element], _T], context: str) -> _T | None:
    """Return the result of ``read`` for the first child element with this tag, or None if there is none.

    Raise ElementError if the child is invalid.
    """
    part = element.first(tag)
    if part is None:
        return None
    try:
        return read(part)
    except ElementError as error:
        raise ElementError(error.line, *error.trail, context) from None


def _read_limit(element: Element) -> Limit:
    lower, upper = _number(element, "lower", 0.0), _number(element, "upper", 0.0)
    return Limit(lower, upper, _required(element, "effort"), _required(element, "velocity"))


def _read_safety(element: Element) -> Safety:
    lower, upper = _optional(element, "soft_lower_limit"), _optional(element, "soft_upper_limit")
    position = _number(element, "k_position", 0.0)
    if "k_velocity" not in element.attributes:
        raise ElementError(element.line, "joint safety: no k_velocity")
    return Safety(_number(element, "k_velocity", 0.0), position, lower, upper)


def _read_calibration(element: Element) -> Calibration:
    return Calibration(_optional(element, "rising"), _optional(element, "falling"))


def _read_mimic(element: Element) -> Mimic:
    if "joint" not in element.attributes:
        raise ElementError(element.line, "joint mimic: no mimic joint specified")
    multiplier, offset = _number(element, "multiplier", 1.0), _number(element, "offset", 0.0)
    return Mimic(element.attributes["joint"], multiplier, offset)


def _read_dynamics(element: Element) -> Dynamics:
    damping, friction = _number(element, "damping", 0.0), _number(element, "friction", 0.0)
    if not element.attributes.keys() & {"damping", "friction"}:
        raise ElementError(element.line, "joint dynamics element specified with no damping and no friction")
    return Dynamics(damping, friction)


def _required(element: Element, name: str) -> float:
    if name not in element.attributes:
        raise ElementError(element.line, f"joint limit: no {name}")
    return _number(element, name, 0.0)


def _optional(element: Element, name: str) -> float | None:
    return _number(element, name, 0.0) if name in element.attributes else None


def _number(element: Element, name: str, default: float) -> float:
    text = element.attributes.get(name)
    if text is None:
        return default
    try:
        return as_float(text)
    except NotANumberError:
        raise ElementError(element.line, f"{name} value ({text}) is not a valid float") from None
