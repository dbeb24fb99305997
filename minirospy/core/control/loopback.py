"""Simulated hardware without a robot: the joints follow their commands, within the limits of the robot description.

A position command is reached by the next cycle, a velocity command is integrated, and an effort command accelerates a mass of 1
kg (or 1 kg m^2) against a damping of 1 N s/m (or N m s/rad). A joint that no controller commands stands still.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from minirospy.base.times import Duration, Time
from minirospy.core.control.hardware import (
    COMMAND_INTERFACES,
    ForceTorqueSensor,
    HardwareError,
    ImuSensor,
    Interface,
    Joint,
    RobotHardware,
)
from minirospy.core.control.transmissions import Transmission
from minirospy.core.urdf.model import Joint as UrdfJoint
from minirospy.core.urdf.model import JointType, Robot

__all__ = ["LoopbackHardware", "movable_joints"]

_GRAVITY = 9.81  # m/s^2
_MASS = 1.0  # kg or kg m^2
_DAMPING = 1.0  # N s/m or N m s/rad
_MOVABLE = {JointType.REVOLUTE, JointType.CONTINUOUS, JointType.PRISMATIC}


class LoopbackHardware(RobotHardware):
    """Simulated hardware with the joints of a robot description.

    A mimic joint follows its master joint. If it has a transmission, it can be commanded instead, and does not follow.
    """

    def __init__(
        self,
        robot: Robot,
        transmissions: list[Transmission],
        initial: Mapping[str, float] | None = None,
        warn: Callable[[str], object] = lambda _: None,
    ) -> None:
        """Create the joints that have a transmission; if none has one, create all movable joints, with all interfaces.

        Call ``warn`` with a line for each transmission or initial position that is ignored. Raise HardwareError if ``initial``
        names a joint that the robot lacks, or contains a value that is not finite.
        """
        super().__init__()
        movable = movable_joints(robot)
        interfaces: dict[str, set[Interface]] = {}
        for each in transmissions:
            if each.joint in movable:
                interfaces.setdefault(each.joint, set()).update(each.interfaces)
            else:
                warn(
                    f"transmission '{each.name}': the robot has no movable joint '{each.joint}', so it is skipped"
                )
        initial = dict(initial or {})
        self._bounds: list[tuple[Joint, float, float]] = []
        self._mimics: list[tuple[Joint, Joint, float, float]] = []
        for name, joint in movable.items():
            if name not in interfaces and (joint.mimic or transmissions):
                continue
            lower, upper = _bounds(joint)
            position = initial.pop(name, min(max(0.0, lower), upper))
            added = self.add_joint(name, *(interfaces.get(name) or COMMAND_INTERFACES), position=position)
            self._bounds.append((added, lower, upper))
        mimics = {name: joint.mimic for name, joint in movable.items() if joint.mimic}
        # Add a mimic joint after the joint that it mimics, which may itself be a mimic joint. Skip joints that mimic each other.
        while ready := [
            name for name, each in mimics.items() if each.joint in self.joints and each.joint not in mimics
        ]:
            for name in ready:
                mimic = mimics.pop(name)
                follower = self.joints.get(name) or self.add_joint(name)
                self._mimics.append((follower, self.joints[mimic.joint], mimic.multiplier, mimic.offset))
        if not self._bounds:
            raise HardwareError(f"robot '{robot.name}' has no joint that can be commanded")
        for name in initial:
            if name not in movable:
                raise HardwareError(f"initial position of '{name}': the robot has no such joint")
            warn(f"the initial position of joint '{name}' is ignored, because it has no transmission")
        self._follow()

    def add_sensors(self, imus: Mapping[str, str], force_torque_sensors: Mapping[str, str]) -> None:
        """Add sensors that measure a robot at rest. Each dict contains the frames of the sensors, by name."""
        for name, frame in imus.items():
            self.imus[name] = ImuSensor(
                name,
                frame,
                (0.0, 0.0, 0.0, 1.0),
                [0.0] * 9,
                (0.0, 0.0, 0.0),
                [0.0] * 9,
                (0.0, 0.0, _GRAVITY),
                [0.0] * 9,
            )
        for name, frame in force_torque_sensors.items():
            self.force_torque_sensors[name] = ForceTorqueSensor(name, frame)

    def read(self, time: Time, period: Duration) -> None:
        """Move the joints according to their last commands.

        A motor would have moved them during the elapsed period. The length of a cycle varies, so write() does not know the period
        yet.
        """
        seconds = period.to_sec()
        for joint, lower, upper in self._bounds:
            before = position = joint.position
            kind = joint.active
            if kind is None:
                joint.velocity = joint.effort = 0.0
                continue
            if kind is Interface.VELOCITY:
                position += joint.velocity_command * seconds
            elif kind is Interface.EFFORT:
                joint.effort = joint.effort_command
                # The exact solution over one cycle is stable for any period.
                settled = joint.effort_command / _DAMPING
                decay = math.exp(-_DAMPING / _MASS * seconds)
                position += settled * seconds + (joint.velocity - settled) * (1 - decay) * _MASS / _DAMPING
                joint.velocity = settled + (joint.velocity - settled) * decay
            else:
                position = joint.position_command
            if not math.isfinite(position):
                position = before
            joint.position = position = min(max(position, lower), upper)
            if seconds > 0 and (kind is not Interface.EFFORT or position in (lower, upper)):
                joint.velocity = (position - before) / seconds
        self._follow()

    def _follow(self) -> None:
        for joint, leader, factor, offset in self._mimics:
            if joint.active is None:
                joint.position = leader.position * factor + offset
                joint.velocity = leader.velocity * factor


def movable_joints(robot: Robot) -> dict[str, UrdfJoint]:
    """Return the joints with a single axis, by name."""
    return {name: joint for name, joint in robot.joints.items() if joint.type in _MOVABLE}


def _bounds(joint: UrdfJoint) -> tuple[float, float]:
    if joint.type is JointType.CONTINUOUS or joint.limit is None:
        return -math.inf, math.inf
    return joint.limit.lower, joint.limit.upper
