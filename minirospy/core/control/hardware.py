"""The hardware side of ros_control: joints, sensors, and the robot hardware that reads and writes them.

Hardware drivers subclass :class:`RobotHardware`. Positions are in radians or metres, velocities in rad/s or m/s, efforts in N m
or N. Source: http://wiki.ros.org/hardware_interface.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

from minirospy.base.errors import MinirospyError
from minirospy.base.times import Duration, Time

__all__ = [
    "COMMAND_FIELDS",
    "COMMAND_INTERFACES",
    "Conflict",
    "ControllerInfo",
    "ForceTorqueSensor",
    "HardwareError",
    "ImuSensor",
    "Interface",
    "InterfaceResources",
    "Joint",
    "RobotHardware",
    "SwitchState",
    "find_conflicts",
]


class HardwareError(MinirospyError):
    """Raised if the hardware lacks a joint, sensor or interface, or if reading or writing it fails."""


class Interface(Enum):
    """A hardware interface; the value is the name of ROS's C++ class, as used in services and messages."""

    JOINT_STATE = "hardware_interface::JointStateInterface"
    POSITION = "hardware_interface::PositionJointInterface"
    VELOCITY = "hardware_interface::VelocityJointInterface"
    EFFORT = "hardware_interface::EffortJointInterface"
    POS_VEL = "hardware_interface::PosVelJointInterface"
    POS_VEL_ACC = "hardware_interface::PosVelAccJointInterface"
    IMU = "hardware_interface::ImuSensorInterface"
    FORCE_TORQUE = "hardware_interface::ForceTorqueSensorInterface"

    @classmethod
    def parse(cls, text: str) -> Interface:
        """Return the interface that a URDF names, such as ``hardware_interface/EffortJointInterface``.

        The package name may be missing, and ``::`` may stand in place of ``/``. Raise HardwareError if the interface does not
        exist.
        """
        name = text.strip().replace("/", "::").rpartition("::")[2]
        for interface in cls:
            if interface.value.endswith(f"::{name}"):
                return interface
        raise HardwareError(f"unknown hardware interface '{text}'")


COMMAND_INTERFACES = frozenset(
    {Interface.POSITION, Interface.VELOCITY, Interface.EFFORT, Interface.POS_VEL, Interface.POS_VEL_ACC}
)
"""The interfaces that command joints. At most one running controller may claim a joint."""

COMMAND_FIELDS = {
    Interface.POSITION: "position_command",
    Interface.VELOCITY: "velocity_command",
    Interface.EFFORT: "effort_command",
}
"""The attribute of a joint that holds an interface's command, for interfaces whose command is a single number."""


@dataclass(slots=True, eq=False)
class Joint:
    """A joint: its state, which the hardware sets in ``read()``, and its commands, which a controller sets in ``update()``.

    ``interfaces``: the interfaces through which the joint can be commanded. ``active``: the interface of the running controller
    that has claimed the joint, or None. The controller manager sets it when it switches controllers, and ``write()`` uses it to
    select the command to send.
    """

    name: str
    interfaces: frozenset[Interface] = frozenset()
    position: float = 0.0
    velocity: float = 0.0
    effort: float = 0.0
    position_command: float = 0.0
    velocity_command: float = 0.0
    acceleration_command: float = 0.0
    effort_command: float = 0.0
    active: Interface | None = None


@dataclass(slots=True, eq=False)
class ImuSensor:
    """An inertial sensor. Quaternions are (x, y, z, w); a covariance has nine numbers, row by row; None means not measured."""

    name: str
    frame_id: str
    orientation: Sequence[float] | None = None
    orientation_covariance: Sequence[float] | None = None
    angular_velocity: Sequence[float] | None = None  # rad/s
    angular_velocity_covariance: Sequence[float] | None = None
    linear_acceleration: Sequence[float] | None = None  # m/s^2
    linear_acceleration_covariance: Sequence[float] | None = None


@dataclass(slots=True, eq=False)
class ForceTorqueSensor:
    """A sensor that measures force (x, y, z in N) and torque (x, y, z in N m) in its frame."""

    name: str
    frame_id: str
    force: Sequence[float] = (0.0, 0.0, 0.0)
    torque: Sequence[float] = (0.0, 0.0, 0.0)


class InterfaceResources(NamedTuple):
    """The joints or sensors that a controller claims through one hardware interface, sorted by name."""

    interface: str
    resources: tuple[str, ...]


class ControllerInfo(NamedTuple):
    """The description of a controller that the hardware receives when controllers are switched."""

    name: str
    type: str
    claimed: tuple[InterfaceResources, ...]


class Conflict(NamedTuple):
    """A joint that more than one controller claims."""

    resource: str
    controllers: tuple[str, ...]


class SwitchState(Enum):
    """The progress of the hardware's switch to new interfaces."""

    DONE = "done"
    ONGOING = "ongoing"
    ERROR = "error"


def find_conflicts(controllers: Iterable[ControllerInfo]) -> list[Conflict]:
    """Return the joints, sorted by name, that more than one of the controllers claims, through any interface."""
    claims: dict[str, list[str]] = {}
    for controller in controllers:
        for _, resources in controller.claimed:
            for resource in resources:
                claims.setdefault(resource, []).append(controller.name)
    return [Conflict(name, tuple(owners)) for name, owners in sorted(claims.items()) if len(owners) > 1]


@dataclass(eq=False)
class RobotHardware:
    """A robot's hardware: its joints and sensors by name. A driver overrides :meth:`read` and :meth:`write`.

    In each cycle the loop calls ``read``, then updates the controllers, then calls ``write``. ``find_conflicts``,
    ``prepare_switch`` and ``resources`` run in a service thread, all other methods in the loop's thread.
    """

    joints: dict[str, Joint] = field(default_factory=dict)
    imus: dict[str, ImuSensor] = field(default_factory=dict)
    force_torque_sensors: dict[str, ForceTorqueSensor] = field(default_factory=dict)

    def add_joint(self, name: str, *interfaces: Interface, position: float = 0.0) -> Joint:
        """Add a joint to command through ``interfaces``; return it. Raise HardwareError if the name is already in use."""
        if name in self.joints:
            raise HardwareError(f"the hardware already has a joint '{name}'")
        if not math.isfinite(position):
            raise HardwareError(f"joint '{name}': its position is {position}")
        joint = Joint(name, frozenset(interfaces), position, position_command=position)
        self.joints[name] = joint
        return joint

    def read(self, time: Time, period: Duration) -> None:
        """Update the states of joints and sensors. ``period``: ROS time since the last cycle."""

    def write(self, time: Time, period: Duration) -> None:
        """Send the joints' commands to the motors. Stop each joint that no interface commands (its ``active`` is None).

        A position motor holds its position without a command. A motor that keeps its last velocity or effort must be sent the
        joint's command, which is then 0.
        """

    def close(self) -> None:
        """Close the device, after a last ``write`` in which no joint is active.

        Both are called even if the hardware has failed.
        """

    def find_conflicts(self, controllers: Sequence[ControllerInfo]) -> list[Conflict]:
        """Return the joints that several of these controllers would claim if they ran together."""
        return find_conflicts(controllers)

    def prepare_switch(self, start: Sequence[ControllerInfo], stop: Sequence[ControllerInfo]) -> bool:
        """Return whether the hardware can start and stop these controllers together."""
        return True

    def do_switch(self, start: Sequence[ControllerInfo], stop: Sequence[ControllerInfo]) -> None:
        """Start to switch the joints' interfaces, before the controllers are stopped and started."""

    def switch_result(self, controller: ControllerInfo | None = None) -> SwitchState:
        """Return the progress of the switch for one controller, or for all controllers if the argument is None."""
        return SwitchState.DONE

    def resources(self) -> Mapping[Interface, Sequence[str]]:
        """Return the sorted names of joints and sensors for each interface that the hardware has."""
        found: dict[Interface, list[str]] = {}
        for joint in self.joints.values():
            for interface in (Interface.JOINT_STATE, *joint.interfaces):
                found.setdefault(interface, []).append(joint.name)
        if self.imus:
            found[Interface.IMU] = list(self.imus)
        if self.force_torque_sensors:
            found[Interface.FORCE_TORQUE] = list(self.force_torque_sensors)
        return {interface: sorted(names) for interface, names in found.items()}
