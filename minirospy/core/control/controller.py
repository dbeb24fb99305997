"""The base class of controllers, and the view of the hardware that a controller gets.

A controller of the user's own is a subclass of :class:`Controller`. Source: http://wiki.ros.org/controller_interface.
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
    """Raised by a controller's ``init`` with the line that the controller manager logs: what is wrong, and where."""


class ControllerState(Enum):
    """A controller's state; the value is the text in the answer of ``list_controllers``."""

    INITIALIZED = "initialized"
    RUNNING = "running"
    STOPPED = "stopped"
    WAITING = "waiting"
    ABORTED = "aborted"


@dataclass(frozen=True)
class ControllerContext:
    """The surroundings of a controller.

    ``namespace``: the controller's, such as ``/arm/gripper``, in which its topics and parameters are. ``root``: the
    manager's, such as ``/arm``. ``name``: as it was loaded, such as ``gripper``. ``robot``: return the robot of
    ``robot_description``, searched upwards from ``root``; raise ControllerError if there is none, or an invalid one.
    """

    namespace: str
    root: str
    name: str
    parameters: Parameters
    robot: Callable[[], Robot]


class Resources:
    """The hardware as one controller sees it in ``init``. It records the joints that the controller claims."""

    def __init__(self, hardware: RobotHardware) -> None:
        self._hardware = hardware
        self._resources = hardware.resources()
        self._claims: dict[Interface, set[str]] = {}

    def names(self, interface: Interface) -> Sequence[str]:
        """Return the sorted names of the joints or sensors of an interface. Raise HardwareError if the robot lacks it."""
        if interface not in self._resources:
            raise HardwareError(
                f"This controller requires a hardware interface of type '{interface.value}'. "
                "Make sure this is registered in the hardware_interface::RobotHW class."
            )
        return self._resources[interface]

    def joint(self, name: str, interface: Interface) -> Joint:
        """Return a joint to command through ``interface``, and claim it.

        Raise HardwareError if the robot does not have the joint there.
        """
        self._check(name, interface)
        self._claims.setdefault(interface, set()).add(name)
        return self._hardware.joints[name]

    def joint_state(self, name: str) -> Joint:
        """Return a joint to read, without a claim. Raise HardwareError if the robot does not have it."""
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
        """Return the claims through each of these interfaces, those without a claim included, as ROS lists them."""
        ordered = dict.fromkeys((*interfaces, *self._claims))
        return tuple(
            InterfaceResources(interface.value, tuple(sorted(self._claims.get(interface, ()))))
            for interface in ordered
        )

    def _check(self, name: str, interface: Interface) -> None:
        if name not in self.names(interface):
            raise HardwareError(f"Could not find resource '{name}' in '{interface.value}'.")


class Controller:
    """A controller: the loop calls ``update`` in each cycle while it runs. A subclass overrides what it needs.

    ``init`` runs in a service's thread, all other methods in the loop's thread: they must not wait, and not call services.
    An exception in ``update`` stops this controller, and no other. Each controller has one object of its class, which
    is created without arguments.
    """

    interfaces: ClassVar[tuple[Interface, ...]] = ()
    """The hardware interfaces that the controller uses; the robot must have them all."""

    @cached_property
    def opened(self) -> ExitStack:
        """The stack of everything that ``init`` opens, for example ``self.opened.callback(subscriber.unregister)``."""
        return ExitStack()

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Read the parameters, claim joints, open topics. Raise ControllerError or HardwareError if that is impossible."""

    def starting(self, time: Time) -> None:
        """Prepare to run, for example hold the present position. The first ``update`` is in the next cycle."""

    def update(self, time: Time, period: Duration) -> None:
        """Compute the joints' commands from their states. ``period``: ROS time since the last cycle."""
        raise NotImplementedError

    def stopping(self, time: Time) -> None:
        """End a motion or a goal."""

    def waiting(self, time: Time) -> None:
        """Note that the start waits for the hardware."""

    def aborting(self, time: Time) -> None:
        """Note that the hardware refused the start."""

    def close(self) -> None:
        """Close what is in ``opened``, in reverse. It is called when the controller is unloaded, or if ``init`` raises."""
        self.opened.close()
