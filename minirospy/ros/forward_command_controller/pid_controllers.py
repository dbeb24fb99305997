"""Base classes of controllers that control position or velocity with a PID controller; subclasses set ``interfaces``.

Source: http://wiki.ros.org/effort_controllers, http://wiki.ros.org/velocity_controllers.
"""

from __future__ import annotations

from contextlib import closing

from control_msgs.msg import JointControllerState

from minirospy import client as rospy
from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import Controller, ControllerContext, ControllerError, Resources
from minirospy.core.control.hardware import COMMAND_FIELDS, Interface, Joint
from minirospy.core.control.position_loop import PositionLoop
from minirospy.core.urdf.model import Robot
from minirospy.ros.control_toolbox.control_toolbox import Pid, PidGains
from minirospy.ros.forward_command_controller.joints import CommandTopic, claim_group, claim_joint
from minirospy.ros.realtime_tools.realtime_tools import RealtimePublisher

__all__ = ["PidJointGroupPositionController", "PidJointPositionController", "PidJointVelocityController"]

_STATE_CYCLES = 10  # cycles per published state, as in ROS


class _PidController(Controller):
    """Commands each joint with the output of a PID controller."""

    _command: CommandTopic

    def __init__(self) -> None:
        self._cycle = 0

    @property
    def _interface(self) -> Interface:
        (interface,) = self.interfaces
        return interface

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Claim the joints, read the gains, and create the publisher and subscriber."""
        self._field = COMMAND_FIELDS[self._interface]

    def _open_command(self, context: ControllerContext, joints: int, *, is_group: bool = False) -> None:
        command = CommandTopic(context, joints, is_group=is_group)
        self._command = self.opened.enter_context(closing(command))

    def _open_state(self, context: ControllerContext) -> None:
        state = RealtimePublisher(f"{context.namespace}/state", JointControllerState)
        self._state = self.opened.enter_context(closing(state))

    def _publish_state(
        self, message: JointControllerState, time: Time, period: Duration, gains: PidGains
    ) -> None:
        """Publish a cycle's state, after setting the fields common to all controllers."""
        message.header.stamp = time
        message.time_step = period.to_sec()
        message.p, message.i, message.d, message.i_clamp, _, message.antiwindup = gains
        self._state.publish(message)

    def _is_state_due(self) -> bool:
        self._cycle += 1
        return self._cycle % _STATE_CYCLES == 1


class PidJointPositionController(_PidController):
    """Moves the joint in the parameter ``joint`` to positions from the topic ``command``, initially its current position."""

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Claim the joint, read the gains in ``pid`` and the joint limits, and create the publisher and subscriber."""
        super().init(hardware, context)
        joint = claim_joint(hardware, context, self._interface)
        pid = Pid.open(context.parameters.below("pid"), self.opened)
        self._loop = _position_loop(joint, _read_robot(context), pid)
        self._open_state(context)
        self._open_command(context, 1)

    def starting(self, time: Time) -> None:
        """Hold the current position."""
        self._command.values = [self._loop.clamp(self._loop.joint.position)]
        self._loop.pid.reset()

    def update(self, time: Time, period: Duration) -> None:
        """Set the joint's command and publish the state."""
        loop = self._loop
        target = loop.clamp(self._command.values[0])
        error = loop.error(target)
        command = loop.pid.compute(error, None, period.to_sec())
        setattr(loop.joint, self._field, command)
        if self._is_state_due():
            state = JointControllerState(
                set_point=target,
                process_value=loop.joint.position,
                process_value_dot=loop.joint.velocity,
                error=error,
                command=command,
            )
            self._publish_state(state, time, period, loop.pid.gains)


class PidJointVelocityController(_PidController):
    """Moves the joint in the parameter ``joint`` at velocities from the topic ``command``, initially 0."""

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Claim the joint, read the gains in ``pid``, and create the publisher and subscriber."""
        super().init(hardware, context)
        self._joint = claim_joint(hardware, context, self._interface)
        self._pid = Pid.open(context.parameters.below("pid"), self.opened)
        self._open_state(context)
        self._open_command(context, 1)

    def starting(self, time: Time) -> None:
        """Command zero velocity and reset the PID controller."""
        self._command.values = [0.0]
        self._pid.reset()

    def update(self, time: Time, period: Duration) -> None:
        """Set the joint's command and publish the state."""
        target, actual = self._command.values[0], self._joint.velocity
        error = target - actual
        command = self._pid.compute(error, None, period.to_sec())
        setattr(self._joint, self._field, command)
        if self._is_state_due():
            state = JointControllerState(set_point=target, process_value=actual, error=error, command=command)
            self._publish_state(state, time, period, self._pid.gains)


class PidJointGroupPositionController(_PidController):
    """Moves the joints in the parameter ``joints`` to positions from the topic ``command``. The gains are in ``JOINT/pid``."""

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Claim the joints, read their gains and limits, and subscribe to the topic."""
        super().init(hardware, context)
        joints = claim_group(hardware, context, self._interface)
        robot = _read_robot(context)
        self._loops = []
        for joint in joints:
            gains = f"{joint.name}/pid"
            try:
                pid = Pid.open(context.parameters.below(gains), self.opened)
            except ControllerError as error:
                rospy.logerr("%s", error)
                raise ControllerError(f"Failed to load PID parameters from {gains}") from error
            self._loops.append(_position_loop(joint, robot, pid))
        self._open_command(context, len(joints), is_group=True)

    def starting(self, time: Time) -> None:
        """Hold the current positions."""
        self._command.values = [loop.clamp(loop.joint.position) for loop in self._loops]
        for loop in self._loops:
            loop.pid.reset()

    def update(self, time: Time, period: Duration) -> None:
        """Set the joint commands."""
        dt = period.to_sec()
        for loop, target in zip(self._loops, self._command.values, strict=True):
            error = loop.error(loop.clamp(target))
            setattr(loop.joint, self._field, loop.pid.compute(error, None, dt))


def _read_robot(context: ControllerContext) -> Robot:
    try:
        return context.robot()
    except ControllerError as error:
        rospy.logerr("%s", error)
        raise ControllerError("Failed to parse urdf file") from error


def _position_loop(joint: Joint, robot: Robot, pid: Pid) -> PositionLoop:
    described = robot.joints.get(joint.name)
    if described is None:
        raise ControllerError(f"Could not find joint '{joint.name}' in urdf")
    return PositionLoop(joint, described, pid)
