"""The transmissions of a robot description: the hardware interfaces through which each joint can be commanded.

Source: http://wiki.ros.org/urdf/XML/Transmission, and the code of transmission_interface.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from minirospy.core.control.hardware import COMMAND_INTERFACES, HardwareError, Interface
from minirospy.core.urdf.elements import Element, parse_xml

__all__ = ["Transmission", "read_transmissions"]


class Transmission(NamedTuple):
    """One joint of a transmission, with its interfaces. ``kind``: for example ``transmission_interface/SimpleTransmission``."""

    name: str
    kind: str
    joint: str
    interfaces: tuple[Interface, ...]


def read_transmissions(
    text: str | bytes, warn: Callable[[str], object], file: str = "robot_description"
) -> list[Transmission]:
    """Return the joints of all transmissions in a description; call ``warn`` with a line for each one skipped.

    Raise UrdfError if the text is not XML.
    """
    found: list[Transmission] = []
    lines: dict[str, None] = {}  # an ordered set: a transmission's joints may repeat a warning
    for element in parse_xml(text, file).all("transmission"):
        found += _read(element, lines.setdefault)
    for line in lines:
        warn(line)
    return found


def _read(element: Element, warn_of: Callable[[str], object]) -> list[Transmission]:
    name = element.attributes.get("name", "")
    kind = _text(element, "type") or element.attributes.get("type", "")

    def warn(why: str) -> None:
        warn_of(f"transmission '{name}': {why}")

    joints, actuators = list(element.all("joint")), list(element.all("actuator"))
    if not (name and kind and joints and actuators):
        missing = {"name": name, "type": kind, "joint": joints, "actuator": actuators}
        warn(
            f"it is skipped, because it has no {' and no '.join(key for key in missing if not missing[key])}"
        )
        return []

    # Use the interfaces of the actuators for joints without one, as older descriptions require.
    shared = [each for actuator in actuators for each in actuator.all("hardwareInterface")]
    found = []
    for joint in joints:
        interfaces: list[Interface] = []
        is_unknown = False
        for each in list(joint.all("hardwareInterface")) or shared:
            try:
                interface = Interface.parse(each.text)
            except HardwareError as error:
                warn(f"{error}, so it is skipped")
                is_unknown = True
                continue
            if interface in COMMAND_INTERFACES and interface not in interfaces:
                interfaces.append(interface)
        if interfaces:
            found.append(Transmission(name, kind, joint.attributes.get("name", ""), tuple(interfaces)))
        elif not is_unknown:
            warn(
                f"joint '{joint.attributes.get('name', '')}' is skipped, because it has no hardware interface"
            )
    return found


def _text(element: Element, tag: str) -> str:
    return next((each.text.strip() for each in element.all(tag)), "")
