"""Transmissions: convert positions, velocities and efforts between actuators and joints, in both directions.

A driver of a coupled mechanism uses them in ``read`` and ``write``. Source: http://wiki.ros.org/transmission_interface, and the
code of the noetic release.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from minirospy.core.control.hardware import HardwareError
from minirospy.core.urdf.elements import Element, parse_xml

__all__ = [
    "DifferentialTransmission",
    "FourBarLinkageTransmission",
    "SimpleTransmission",
    "TransmissionMap",
    "load_transmissions",
]

_Matrix = tuple[tuple[float, ...], ...]


class TransmissionMap:
    """The base class of all transmissions. Values are in the order of the names in ``actuators`` and ``joints``."""

    actuators: Sequence[str] = ()
    joints: Sequence[str] = ()

    def __init__(self, motion: _Matrix, effort: _Matrix, offsets: Sequence[float]) -> None:
        """Set the joints' zero positions, and the matrices that convert velocities and efforts from actuators to joints."""
        self._motion, self._effort, self._offsets = motion, effort, tuple(offsets)
        self._inverse_motion, self._inverse_effort = _inverse(motion), _inverse(effort)

    def joint_positions(self, actuators: Sequence[float]) -> list[float]:
        """Return the joint positions for these actuator positions."""
        moved = _product(self._motion, actuators)
        return [position + offset for position, offset in zip(moved, self._offsets, strict=True)]

    def joint_velocities(self, actuators: Sequence[float]) -> list[float]:
        """Return the joint velocities for these actuator velocities."""
        return _product(self._motion, actuators)

    def joint_efforts(self, actuators: Sequence[float]) -> list[float]:
        """Return the joint efforts for these actuator efforts."""
        return _product(self._effort, actuators)

    def actuator_positions(self, joints: Sequence[float]) -> list[float]:
        """Return the actuator positions for these joint positions."""
        moved = [position - offset for position, offset in zip(joints, self._offsets, strict=True)]
        return _product(self._inverse_motion, moved)

    def actuator_velocities(self, joints: Sequence[float]) -> list[float]:
        """Return the actuator velocities for these joint velocities."""
        return _product(self._inverse_motion, joints)

    def actuator_efforts(self, joints: Sequence[float]) -> list[float]:
        """Return the actuator efforts for these joint efforts."""
        return _product(self._inverse_effort, joints)


class SimpleTransmission(TransmissionMap):
    """One actuator and one joint. Raise HardwareError if the reduction is 0."""

    def __init__(self, reduction: float, joint_offset: float = 0.0) -> None:
        if not reduction:
            raise HardwareError("Transmission reduction ratio cannot be zero.")
        super().__init__(((1 / reduction,),), ((reduction,),), (joint_offset,))


class DifferentialTransmission(TransmissionMap):
    """Joint 1 moves with the sum of two actuators, joint 2 with their difference. Raise HardwareError if a reduction is 0."""

    def __init__(
        self,
        actuator_reduction: Sequence[float],
        joint_reduction: Sequence[float] = (1.0, 1.0),
        joint_offset: Sequence[float] = (0.0, 0.0),
    ) -> None:
        a, b, c, d = _reductions(actuator_reduction, joint_reduction, joint_offset, "differential")
        motion = (
            (_reciprocal(2 * a * c), _reciprocal(2 * b * c)),
            (_reciprocal(2 * a * d), -_reciprocal(2 * b * d)),
        )
        super().__init__(motion, ((a * c, b * c), (a * d, -b * d)), joint_offset)


class FourBarLinkageTransmission(TransmissionMap):
    """Actuator 1 moves joint 1; joint 2 moves by actuator 2's motion minus joint 1's. Raise HardwareError if a reduction is 0."""

    def __init__(
        self,
        actuator_reduction: Sequence[float],
        joint_reduction: Sequence[float] = (1.0, 1.0),
        joint_offset: Sequence[float] = (0.0, 0.0),
    ) -> None:
        a, b, c, d = _reductions(actuator_reduction, joint_reduction, joint_offset, "four-bar linkage")
        motion = ((_reciprocal(a * c), 0.0), (-_reciprocal(a * c * d), _reciprocal(b * d)))
        # These are ROS's formulas, although they do not conserve power between actuators and joints.
        super().__init__(motion, ((a * c, 0.0), (-a * c * d, b * d)), joint_offset)


def load_transmissions(text: str | bytes, file: str = "robot_description") -> dict[str, TransmissionMap]:
    """Return the simple, differential and four-bar linkage transmissions in a description, by name.

    Raise UrdfError if the text is not XML, or HardwareError, with ROS's text, if a transmission is invalid.
    """
    found: dict[str, TransmissionMap] = {}
    for element in parse_xml(text, file).all("transmission"):
        name = element.attributes.get("name", "")
        kind = (_text(element, "type") or "").rpartition("/")[2]
        if kind == "SimpleTransmission":
            ((actuator, reduction, _),), ((joint, _, offset),) = _sides(element, name, 1)
            found[name] = SimpleTransmission(reduction, offset)
            found[name].actuators, found[name].joints = (actuator,), (joint,)
        elif coupled := _COUPLED.get(kind):
            actuators, joints = _sides(element, name, 2)
            names, reductions, _ = zip(*actuators, strict=True)
            joint_names, joint_reductions, offsets = zip(*joints, strict=True)
            found[name] = coupled(reductions, joint_reductions, offsets)
            found[name].actuators, found[name].joints = names, joint_names
    return found


_COUPLED = {
    "DifferentialTransmission": DifferentialTransmission,
    "FourBarLinkageTransmission": FourBarLinkageTransmission,
}

_Part = tuple[str, float, float]  # an actuator or a joint: name, reduction, offset


def _sides(transmission: Element, name: str, count: int) -> tuple[list[_Part], list[_Part]]:
    """Return the actuators and joints of a transmission, in the order of their roles."""
    sides = []
    for tag in ("actuator", "joint"):
        elements = list(transmission.all(tag))
        if len(elements) != count:
            raise HardwareError(
                f"Invalid description for transmission '{name}' of type '{_text(transmission, 'type')}'. "
                f"Expected {count} {tag}s, got {len(elements)}."
            )
        parts = []
        for element in elements:
            named = f"{tag.title()} '{element.attributes.get('name', '')}' of transmission '{name}'"
            default = None if tag == "actuator" else 1.0
            part = (
                element.attributes.get("name", ""),
                _number(element, "mechanicalReduction", default, named),
                _number(element, "offset", 0.0, named) if tag == "joint" else 0.0,
            )
            parts.append((_role(element, tag, named) if count > 1 else "", part))
        if count > 1 and parts[0][0] == parts[1][0]:
            first, second = (part[0] for _, part in parts)
            raise HardwareError(
                f"{tag.title()}s '{first}' and '{second}' of transmission '{name}' must have different roles. "
                f"Both specify '{parts[0][0]}'."
            )
        sides.append([part for _, part in sorted(parts)])
    return sides[0], sides[1]


def _role(element: Element, tag: str, named: str) -> str:
    role = _text(element, "role")
    if role is None:
        raise HardwareError(f"{named} does not specify the required <role> element.")
    if role not in (f"{tag}1", f"{tag}2"):
        raise HardwareError(
            f"{named} does not specify a valid <role> element. Got '{role}', expected '{tag}1' or '{tag}2'."
        )
    return role


def _number(element: Element, tag: str, default: float | None, named: str) -> float:
    text = _text(element, tag)
    if text is None:
        if default is None:
            raise HardwareError(f"{named} does not specify the required <{tag}> element.")
        return default
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise HardwareError(f"{named} specifies the <{tag}> element, but is not a number.")
    return value


def _text(element: Element, tag: str) -> str | None:
    found = element.first(tag)
    return None if found is None else found.text.strip()


def _reductions(
    actuators: Sequence[float], joints: Sequence[float], offsets: Sequence[float], kind: str
) -> Sequence[float]:
    if not len(actuators) == len(joints) == len(offsets) == 2:
        raise HardwareError(f"Reduction and offset vectors of a {kind} transmission must have size 2.")
    if not all((*actuators, *joints)):
        raise HardwareError("Transmission reduction ratios cannot be zero.")
    return (*actuators, *joints)


def _product(matrix: _Matrix, values: Sequence[float]) -> list[float]:
    return [sum(factor * value for factor, value in zip(row, values, strict=True)) for row in matrix]


def _reciprocal(value: float) -> float:
    """Return 1 / value. Raise HardwareError if the product of reductions overflowed or underflowed."""
    if not value or not math.isfinite(value):
        raise HardwareError("Transmission reduction ratios are too large or too small.")
    return 1 / value


def _inverse(matrix: _Matrix) -> _Matrix:
    """Return the inverse of a 1x1 or 2x2 matrix."""
    if len(matrix) == 1:
        return ((1 / matrix[0][0],),)
    (a, b), (c, d) = matrix
    determinant = a * d - b * c
    _reciprocal(determinant)  # raises HardwareError if there is no inverse
    return (d / determinant, -b / determinant), (-c / determinant, a / determinant)
