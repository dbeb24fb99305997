"""The base class of hardware drivers: ``from hardware_interface import RobotHardware``.

ROS's package has only C++ headers. Source: http://wiki.ros.org/hardware_interface.
"""

from minirospy.core.control.hardware import (
    ControllerInfo,
    ForceTorqueSensor,
    HardwareError,
    ImuSensor,
    Interface,
    InterfaceResources,
    Joint,
    RobotHardware,
    SwitchState,
)

__all__ = [
    "ControllerInfo",
    "ForceTorqueSensor",
    "HardwareError",
    "ImuSensor",
    "Interface",
    "InterfaceResources",
    "Joint",
    "RobotHardware",
    "SwitchState",
]
