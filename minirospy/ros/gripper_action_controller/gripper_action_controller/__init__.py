"""Controllers for grippers with one joint: ``from gripper_action_controller import GripperActionController``.

ROS's package has these classes in C++ only. Their decisions are made in `minirospy/core/control/gripper.py`. Source:
http://wiki.ros.org/gripper_action_controller.
"""

from __future__ import annotations

import math
from contextlib import closing

from control_msgs.msg import GripperCommandAction, GripperCommandGoal, GripperCommandResult

from minirospy import client as rospy
from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import Controller, ControllerContext, ControllerError, Resources
from minirospy.core.control.goal import MonitoredGoal, Outcome
from minirospy.core.control.gripper import Gripper, GripperCommand, GripperLimits
from minirospy.core.control.hardware import Interface, Joint
from minirospy.ros.control_toolbox.control_toolbox import Pid
from minirospy.ros.realtime_tools.realtime_tools import RealtimeActionServer, Rejection

__all__ = ["EffortGripperActionController", "GripperActionController", "PositionGripperActionController"]

_SECOND = 1_000_000_000  # ns
_NOT_RUNNING = "Can't accept new action goals. Controller is not running."


class GripperActionController(Controller):
    """Executes the action ``gripper_cmd``. A subclass sets ``interfaces`` and overrides :meth:`send` for its hardware interface.

    As in ROS, it publishes no feedback. A result contains the values of the cycle that decided the outcome. In ROS, it contains
    the values at the time it is sent, up to one period of ``action_monitor_rate`` later.
    """

    joint: Joint
    gripper: Gripper

    def __init__(self) -> None:
        self.is_running = False
        self._effort = 0.0  # last commanded effort

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Read the parameters, claim the joint and create the action server."""
        parameters = context.parameters
        monitor_rate = parameters.finite("action_monitor_rate", 20.0)
        if monitor_rate <= 0.0:
            raise ControllerError(f"action_monitor_rate must be above 0 (namespace: {context.namespace}).")
        name = parameters.text("joint", "")
        if not name:
            raise ControllerError("Could not find joint name on param server")
        if name not in context.robot().joints:
            raise ControllerError(f"Could not find joint '{name}' in URDF model.")
        if name not in hardware.names(self.interfaces[0]):
            raise ControllerError(f"Could not find joint '{name}' in '{self.interfaces[0].value}'.")
        self.joint = hardware.joint(name, self.interfaces[0])

        usual = GripperLimits()
        self.gripper = Gripper(
            GripperLimits(
                abs(parameters.finite("goal_tolerance", usual.goal_tolerance)),
                abs(parameters.finite("max_effort", usual.max_effort)),
                parameters.finite("stall_velocity_threshold", usual.stall_velocity),
                round(parameters.finite("stall_timeout", 1.0) * _SECOND),
            )
        )
        self.read_gains(context)
        action = RealtimeActionServer(
            f"{context.namespace}/gripper_cmd",
            GripperCommandAction,
            self._accept,
            self._hold,
            _result,
            max(1, round(_SECOND / monitor_rate)),
        )
        self._action = self.opened.enter_context(closing(action))

    def read_gains(self, context: ControllerContext) -> None:
        """Read the parameters specific to the hardware interface."""

    def starting(self, time: Time) -> None:
        """Hold the current position."""
        self._hold()
        self._action.start()
        self.is_running = True  # set last: goals are accepted from here on, and need a started action server

    def update(self, time: Time, period: Duration) -> None:
        """Send this cycle's command and, when due, the goal's result."""
        joint, now = self.joint, time.to_nsec()
        command = self.gripper.check(now, joint.position, joint.velocity, self._effort)
        self._effort = self.send(command, period.to_nsec() / _SECOND)
        self._action.report(now)

    def send(self, command: GripperCommand, dt: float) -> float:
        """Set the joint's command; return the effort for the goal's result. ``dt`` is in seconds since the last cycle."""
        raise NotImplementedError

    def stopping(self, time: Time) -> None:
        """Cancel the goal."""
        self.is_running = False
        self._action.stop()

    def aborting(self, time: Time) -> None:
        """Cancel the goal."""
        self.stopping(time)

    def _hold(self) -> None:
        position = self.joint.position
        self.gripper.hold(position if math.isfinite(position) else self.joint.position_command)

    def _accept(self, message: GripperCommandGoal) -> MonitoredGoal:
        if not self.is_running:
            rospy.logerr(_NOT_RUNNING)
            raise Rejection(GripperCommandResult())
        position, max_effort = message.command.position, message.command.max_effort
        if not (math.isfinite(position) and math.isfinite(max_effort)):
            text = f"The goal's position is {position}, its max_effort {max_effort}; both must be finite numbers."
            rospy.logerr(text)
            raise Rejection(GripperCommandResult(), text)
        goal = MonitoredGoal()
        self.gripper.command = GripperCommand(position, max_effort, goal, rospy.Time.now().to_nsec())
        return goal


class PositionGripperActionController(GripperActionController):
    """position_controllers/GripperActionController: commands the goal's position and reports its max_effort."""

    interfaces = (Interface.POSITION,)

    def send(self, command: GripperCommand, dt: float) -> float:
        """Command the position; return the effort to report."""
        self.joint.position_command = command.position
        return command.max_effort


class EffortGripperActionController(GripperActionController):
    """effort_controllers/GripperActionController: computes the effort with a PID controller from ``gains/JOINT``.

    As in ROS, a goal with max_effort 0 allows no effort at all.
    """

    interfaces = (Interface.EFFORT,)

    def read_gains(self, context: ControllerContext) -> None:
        """Read the gains and make them configurable with dynamic_reconfigure."""
        self._pid = Pid.open(context.parameters.below(f"gains/{self.joint.name}"), self.opened)

    def starting(self, time: Time) -> None:
        """Hold the current position, with zero effort until the first update."""
        self._pid.reset()
        self.joint.effort_command = 0.0
        super().starting(time)

    def send(self, command: GripperCommand, dt: float) -> float:
        """Command the effort and return it."""
        joint, limit = self.joint, abs(command.max_effort)
        effort = self._pid.compute(command.position - joint.position, -joint.velocity, dt)
        joint.effort_command = min(max(effort, -limit), limit)
        return joint.effort_command


def _result(outcome: Outcome) -> GripperCommandResult:
    return GripperCommandResult(*outcome.result)
