"""The joints of a simulated model as ros_control hardware."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from minirospy.base.times import Duration, Time
from minirospy.core.control.hardware import Interface, Joint, RobotHardware
from minirospy.core.control.limits import JointLimits
from minirospy.core.control.pid import Pid
from minirospy.core.control.position_loop import PositionLoop
from minirospy.core.control.transmissions import Transmission
from minirospy.core.urdf.model import JointType, Robot

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics import SimJoint, SimModel

__all__ = ["SimulatedHardware"]

FindPid = Callable[[str], "Pid | None"]
"""Returns the PID controller of a joint if the joint's gains are set as parameters, else None."""


class SimulatedHardware(RobotHardware):
    """Reads and commands all joints that have a transmission, like gazebo_ros_control's DefaultRobotHWSim.

    A motor moves a joint without a PID controller to a position, or holds its velocity. ``is_stopped``: the emergency stop, which
    holds positions and sets velocities and efforts to 0.
    """

    def __init__(
        self, model: SimModel, robot: Robot, transmissions: Sequence[Transmission], find_pid: FindPid
    ) -> None:
        super().__init__()
        self.is_stopped = False
        self._drives: list[_Drive] = []
        for each in transmissions:
            simulated = model.joints[each.joint]
            joint = self.add_joint(each.joint, *each.interfaces, position=simulated.position)
            described = robot.joints.get(each.joint)
            turns = described is not None and described.type in (JointType.REVOLUTE, JointType.CONTINUOUS)
            pid = None if each.interfaces[0] is Interface.EFFORT else find_pid(each.joint)
            loop = PositionLoop(joint, described, pid) if described is not None and pid is not None else None
            self._drives.append(_Drive(simulated, joint, each.interfaces[0], turns, pid, loop))

    def set_limits(self, limits: Mapping[str, JointLimits]) -> None:
        """Set the motors' maximum efforts."""
        for drive in self._drives:
            if drive.joint.name in limits:
                drive.max_effort = abs(limits[drive.joint.name].effort)

    def read(self, _time: Time, _period: Duration) -> None:
        """Update the joint states."""
        for drive in self._drives:
            drive.read()

    def write(self, _time: Time, period: Duration) -> None:
        """Write the commands to the joints."""
        seconds = period.to_sec()
        for drive in self._drives:
            drive.write(seconds, self.is_stopped)


class _Drive:
    """A joint and the method that commands it."""

    def __init__(
        self,
        simulated: SimJoint,
        joint: Joint,
        first: Interface,
        turns: bool,
        pid: Pid | None,
        loop: PositionLoop | None,
    ) -> None:
        self.joint = joint
        self.max_effort = math.inf
        self._simulated = simulated
        self._first = first
        self._turns = turns
        self._pid = pid
        self._loop = loop
        self._held: float | None = None  # position at the time of the emergency stop
        self._target = joint.position  # last finite position command

    def read(self) -> None:
        position = self._simulated.position
        joint = self.joint
        # Keep a rotating joint's position continuous over any number of turns, even after a jump.
        way = position - joint.position
        joint.position += math.remainder(way, math.tau) if self._turns else way
        joint.velocity = self._simulated.velocity
        joint.effort = self._simulated.effort

    def write(self, seconds: float, is_stopped: bool) -> None:
        """Write the command. In place of one that is not finite, write 0 or, for a position, the last finite command.

        Controllers may set such a command after the limits were enforced.
        """
        joint, simulated = self.joint, self._simulated
        kind = joint.active or self._first
        if kind is Interface.EFFORT:
            is_commanded = joint.active is not None and not is_stopped
            simulated.set_force(_finite(joint.effort_command) if is_commanded else 0.0)
            return
        if kind is Interface.VELOCITY:
            velocity = 0.0 if is_stopped else _finite(joint.velocity_command)
            if self._pid is None:
                simulated.set_velocity(velocity, self.max_effort)
            else:
                self._push(self._pid.compute(velocity - joint.velocity, None, seconds))
            return
        if not is_stopped:
            self._held = None
        elif self._held is None:
            self._held = joint.position
        if math.isfinite(joint.position_command):
            self._target = joint.position_command
        position = self._target if self._held is None else self._held
        if self._pid is None:
            # As in Gazebo, the joint reaches the position regardless of the effort.
            simulated.set_position(position + simulated.position - joint.position)
        else:
            error = self._loop.error(position) if self._loop is not None else position - joint.position
            self._push(self._pid.compute(error, None, seconds))

    def _push(self, effort: float) -> None:
        self._simulated.set_force(min(max(effort, -self.max_effort), self.max_effort))


def _finite(command: float) -> float:
    return command if math.isfinite(command) else 0.0
