"""The base class of controllers, and the classes through which a controller accesses the hardware.

User-defined controllers subclass :class:`Controller`. Source: http://wiki.ros.org/controller_interface.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import ClassVar

from minirospy.base.errors import MinirospyError
from minirospy.base.times import Duration, Time
from minirospy.core.control.hardware import (
    ForceTorqueSensor,
    HardwareError,
    ImuSensor,
    Interface,
    InterfaceResources,
    Joint,
    RobotHardware,
)
from minirospy.core.control.parameters import Parameters
from minirospy.core.urdf.model import Robot

__all__ = ["Controller", "ControllerContext", "ControllerError", "ControllerState", "Resources"]


class ControllerError(MinirospyError):
    """Raised by a controller's ``init``. The controller manager logs the text, which names the fault and its location."""


class ControllerState(Enum):
    """A controller's state; the value is the text in a ``list_controllers`` response."""

    INITIALIZED = "initialized"
    RUNNING = "running"
    STOPPED = "stopped"
    WAITING = "waiting"
    ABORTED = "aborted"


@dataclass(frozen=True)
class ControllerContext:
    """The environment that a controller's ``init`` receives.

    ``namespace``: the controller's namespace, such as ``/arm/gripper``, which contains its topics and parameters. ``root``: the
    manager's namespace, such as ``/arm``. ``name``: the name under which the controller was loaded, such as ``gripper``.
    ``robot``: return the robot of the parameter ``robot_description``, searched upwards from ``root``; raise ControllerError if
    the parameter is missing or invalid.
    """

    namespace: str
    root: str
    name: str
    parameters: Parameters
    robot: Callable[[], Robot]


class Resources:
    """The hardware as one controller sees it in ``init``. It records which joints the controller claims."""

    def __init__(self, hardware: RobotHardware) -> None:
        self._hardware = hardware
        self._resources = hardware.resources()
        self._claims: dict[Interface, set[str]] = {}

    def names(self, interface: Interface) -> Sequence[str]:
        """Return the sorted names of an interface's joints or sensors. Raise HardwareError if the robot lacks the interface."""
        if interface not in self._resources:
            raise HardwareError(
                f"This controller requires a hardware interface of type '{interface.value}'. "
                "Make sure this is registered in the hardware_interface::RobotHW class."
            )
        return self._resources[interface]

    def joint(self, name: str, interface: Interface) -> Joint:
        """Claim a joint to command through ``interface``, and return it.

        Raise HardwareError if the joint does not exist in this interface.
        """
        self._check(name, interface)
        self._claims.setdefault(interface, set()).add(name)
        return self._hardware.joints[name]

    def joint_state(self, name: str) -> Joint:
        """Return a joint for reading only, without claiming it. Raise HardwareError if the robot does not have the joint."""
        self._check(name, Interface.JOINT_STATE)
        return self._hardware.joints[name]

    def imu(self, name: str) -> ImuSensor:
        """Return an inertial sensor. Raise HardwareError if the robot does not have it."""
        self._check(name, Interface.IMU)
        return self._hardware.imus[name]

    def force_torque_sensor(self, name: str) -> ForceTorqueSensor:
        """Return a force and torque sensor. Raise HardwareError if the robot does not have it."""
        self._check(name, Interface.FORCE_TORQUE)
        return self._hardware.force_torque_sensors[name]

    def claimed(self, interfaces: Sequence[Interface]) -> tuple[InterfaceResources, ...]:
        """Return the claims per interface; as in ROS, an interface without claims is listed, too."""
        ordered = dict.fromkeys((*interfaces, *self._claims))
        return tuple(
            InterfaceResources(interface.value, tuple(sorted(self._claims.get(interface, ()))))
            for interface in ordered
        )

    def _check(self, name: str, interface: Interface) -> None:
        if name not in self.names(interface):
            raise HardwareError(f"Could not find resource '{name}' in '{interface.value}'.")


class Controller:
    """A controller. While it runs, the loop calls ``update`` once per cycle. Subclasses override the methods that they need.

    ``init`` runs in a service thread, and so does ``close``, except at the end of the loop. All other methods run in the loop's
    thread, and must neither block nor call services. An exception in ``update`` stops only this controller. Each controller is a
    separate instance of its class, created without arguments.
    """

    interfaces: ClassVar[tuple[Interface, ...]] = ()
    """The hardware interfaces that the controller uses. Loading fails if the robot lacks one of them."""

    @cached_property
    def opened(self) -> ExitStack:
        """An ExitStack for everything that ``init`` opens, for example ``self.opened.callback(subscriber.unregister)``."""
        return ExitStack()

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Read the parameters, claim joints, open topics. Raise ControllerError or HardwareError if one of these fails."""

    def starting(self, time: Time) -> None:
        """Prepare to run, for example hold the present position. The first ``update`` follows in the next cycle."""

    def update(self, time: Time, period: Duration) -> None:
        """Compute the joints' commands from their states. ``period``: ROS time since the last cycle."""
        raise NotImplementedError

    def stopping(self, time: Time) -> None:
        """End the current motion or goal, because the controller is being stopped."""

    def waiting(self, time: Time) -> None:
        """Handle a start that is delayed because the hardware is not ready."""

    def aborting(self, time: Time) -> None:
        """Handle a start that the hardware refused."""

    def close(self) -> None:
        """Close everything in ``opened``, in reverse order. Called when the controller is unloaded, or if ``init`` raises."""
        self.opened.close()
