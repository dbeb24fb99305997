"""The node ``rosrun minirospy_hardware loopback``: runs controllers without a robot.

The joints are those of ``robot_description``, searched upwards from the node's namespace. Private parameters: rate (100 Hz),
initial (``{joint: position}``), imus and force_torque_sensors (``{sensor: frame}``).
"""

from __future__ import annotations

from typing import Any

from minirospy import client as rospy
from minirospy.base.errors import UrdfError
from minirospy.core.control.hardware import HardwareError
from minirospy.core.control.loopback import LoopbackHardware
from minirospy.core.control.transmissions import read_transmissions
from minirospy.core.urdf.read import parse_robot
from minirospy.ros.controller_manager.loop import run
from minirospy.ros.controller_manager.manager import find_description

__all__ = ["main"]


def main() -> int:
    """Run the node until it shuts down; return 1 if a parameter is invalid, else 0."""
    rospy.init_node("loopback")
    try:
        rate = rospy.get_param("~rate", 100.0)
        if not isinstance(rate, (int, float)):
            raise HardwareError(f"parameter ~rate must be a number of cycles per second, not {rate!r}")
        return run(_hardware(), rate)
    except (HardwareError, UrdfError, ValueError) as error:
        rospy.logfatal("%s", error)
        return 1
    except rospy.ROSInterruptException:
        return 0


def _hardware() -> LoopbackHardware:
    text = find_description(rospy.get_namespace())
    if text is None:
        raise HardwareError(
            "there is no parameter robot_description in the namespace "
            f"{rospy.get_namespace()} or above: a launch file or `rosparam set robot_description -t FILE` sets it"
        )
    initial = _mapping("initial", (int, float), "from joint to position")
    imus = _mapping("imus", (str,), "from sensor to frame")
    sensors = _mapping("force_torque_sensors", (str,), "from sensor to frame")

    def warn(line: str) -> None:
        rospy.logwarn("%s", line)

    hardware = LoopbackHardware(parse_robot(text), read_transmissions(text, warn), initial, warn)
    hardware.add_sensors(imus, sensors)
    return hardware


def _mapping(name: str, kinds: tuple[type, ...], meaning: str) -> dict[str, Any]:
    """Return a private parameter that must be a dictionary. Raise HardwareError if it is not."""
    value = rospy.get_param(f"~{name}", {})
    if not isinstance(value, dict) or not all(isinstance(each, kinds) for each in value.values()):
        raise HardwareError(f"parameter ~{name} must be a map {meaning}, not {value!r}")
    return value
