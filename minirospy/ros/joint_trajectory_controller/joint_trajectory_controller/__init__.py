"""Controllers that execute trajectories of joints: ``from joint_trajectory_controller import JointTrajectoryController``.

ROS's package has these classes in C++ only. Their decisions are made in `minirospy/core/control/trajectory_follower.py`. Source:
http://wiki.ros.org/joint_trajectory_controller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import closing
from typing import ClassVar, TypeVar

from control_msgs.msg import (
    FollowJointTrajectoryAction,
    FollowJointTrajectoryFeedback,
    FollowJointTrajectoryGoal,
    FollowJointTrajectoryResult,
    JointTolerance,
    JointTrajectoryControllerState,
)
from control_msgs.srv import QueryTrajectoryState, QueryTrajectoryStateRequest, QueryTrajectoryStateResponse
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from minirospy import client as rospy
from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import Controller, ControllerContext, ControllerError, Resources
from minirospy.core.control.goal import MonitoredGoal, Outcome
from minirospy.core.control.hardware import Interface, Joint
from minirospy.core.control.trajectory import (
    ErrorCode,
    JointTolerances,
    PastTrajectoryError,
    Point,
    TrajectoryError,
)
from minirospy.core.control.trajectory_follower import (
    GoalTolerance,
    JointsError,
    TrajectoryFollower,
    read_joints,
)
from minirospy.ros.control_toolbox.control_toolbox import Pid
from minirospy.ros.realtime_tools.realtime_tools import RealtimeActionServer, RealtimePublisher, Rejection

__all__ = [
    "EffortJointTrajectoryController",
    "JointTrajectoryController",
    "PosVelAccJointTrajectoryController",
    "PosVelJointTrajectoryController",
    "PositionJointTrajectoryController",
    "VelocityJointTrajectoryController",
]

_State = TypeVar("_State", JointTrajectoryControllerState, FollowJointTrajectoryFeedback)

_SECOND = 1_000_000_000  # ns
_NOT_RUNNING = "Can't accept new {}. Controller is not running."
_WRONG_JOINTS = "Joints on incoming goal don't match the controller joints."


class JointTrajectoryController(Controller):
    """Executes trajectories from the topic ``command`` and the action ``follow_joint_trajectory``.

    A subclass for a hardware interface sets ``interfaces`` and overrides :meth:`send`; it also overrides :meth:`reset` if it has
    state.
    """

    joints: Sequence[Joint]
    follower: TrajectoryFollower

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Read the parameters, claim the joints, and create the topics, the action server and the service."""
        parameters = context.parameters
        state_rate = parameters.finite("state_publish_rate", 50.0)
        monitor_rate = parameters.finite("action_monitor_rate", 20.0)
        stop_duration = parameters.finite("stop_trajectory_duration", 0.0)
        if state_rate <= 0.0 or monitor_rate <= 0.0 or stop_duration < 0.0:
            raise ControllerError(
                "state_publish_rate and action_monitor_rate must be above 0, stop_trajectory_duration at least 0 "
                f"(namespace: {context.namespace})."
            )

        followed = read_joints(parameters, context.robot)
        self._names = [joint.name for joint in followed]
        self.joints = [_claim(hardware, name, self.interfaces[0]) for name in self._names]
        self.follower = TrajectoryFollower(
            followed, round(stop_duration * _SECOND), parameters.flag("allow_partial_joints_goal", False)
        )
        self.read_gains(context)

        self._state_period = max(1, round(_SECOND / state_rate))  # ns
        self._state_due = 0  # time at which to publish the next state, in ns of uptime
        state = RealtimePublisher(f"{context.namespace}/state", JointTrajectoryControllerState)
        self._state = self.opened.enter_context(closing(state))
        action = RealtimeActionServer(
            f"{context.namespace}/follow_joint_trajectory",
            FollowJointTrajectoryAction,
            self._accept,
            self.follower.request_hold,
            _result,
            max(1, round(_SECOND / monitor_rate)),
        )
        self._action = self.opened.enter_context(closing(action))
        command = rospy.Subscriber(
            f"{context.namespace}/command", JointTrajectory, self._receive_command, queue_size=1
        )
        self.opened.callback(command.unregister)
        query = rospy.Service(f"{context.namespace}/query_state", QueryTrajectoryState, self._query_state)
        self.opened.callback(query.shutdown)

    def read_gains(self, context: ControllerContext) -> None:
        """Read the parameters specific to the hardware interface."""

    def starting(self, time: Time) -> None:
        """Hold the current positions."""
        positions = [
            joint.position if math.isfinite(joint.position) else joint.position_command
            for joint in self.joints
        ]
        self._action.start()  # start first, so that the action is ready for each goal that the follower accepts
        self.follower.start(time.to_nsec(), positions, [joint.velocity for joint in self.joints])
        self._state_due = self._state_period
        self.reset()

    def update(self, time: Time, period: Duration) -> None:
        """Send this cycle's commands; publish the state, the feedback and the goal's result when due."""
        joints, follower = self.joints, self.follower
        now = time.to_nsec()
        elapsed = period.to_nsec()
        positions = [joint.position for joint in joints]
        velocities = [joint.velocity for joint in joints]
        follower.update(now, elapsed, positions, velocities)
        self.send(elapsed / _SECOND)

        if follower.uptime > self._state_due and self._state.publish(
            self._fill(JointTrajectoryControllerState(), time, positions, velocities)
        ):
            late = (follower.uptime - self._state_due) // self._state_period
            self._state_due += self._state_period * (1 + late)
        if self._action.report(now):
            self._action.publish_feedback(
                self._fill(FollowJointTrajectoryFeedback(), time, positions, velocities)
            )

    def stopping(self, time: Time) -> None:
        """Cancel the goal."""
        self.follower.stop()
        self._action.stop()

    def aborting(self, time: Time) -> None:
        """Cancel the goal."""
        self.stopping(time)

    def send(self, dt: float) -> None:
        """Set the joint commands from the follower's desired states and errors. ``dt`` is in seconds since the last cycle."""
        raise NotImplementedError

    def reset(self) -> None:
        """Set the commands that the joints follow until the first update."""

    def _fill(self, message: _State, time: Time, positions: list[float], velocities: list[float]) -> _State:
        """Fill a message with this cycle's states."""
        follower = self.follower
        desired_time, actual_time = follower.times_from_start()
        message.header.stamp = time
        message.joint_names = self._names
        message.desired = JointTrajectoryPoint(
            positions=follower.positions,
            velocities=follower.velocities,
            accelerations=follower.accelerations,
            time_from_start=Duration.from_sec(desired_time),
        )
        message.actual = JointTrajectoryPoint(
            positions=positions, velocities=velocities, time_from_start=Duration.from_sec(actual_time)
        )
        message.error = JointTrajectoryPoint(
            positions=follower.position_errors,
            velocities=follower.velocity_errors,
            time_from_start=Duration.from_sec(desired_time - actual_time),
        )
        return message

    def _receive_command(self, message: JointTrajectory) -> None:
        try:
            self._request(message, None, None)
        except TrajectoryError as error:
            _log(error)
        else:
            self._action.preempt()

    def _accept(self, message: FollowJointTrajectoryGoal) -> MonitoredGoal:
        if not self.follower.is_running:
            rospy.logerr(_NOT_RUNNING.format("action goals"))
            raise Rejection(FollowJointTrajectoryResult(error_code=ErrorCode.INVALID_GOAL))
        goal = MonitoredGoal()
        try:
            self.follower.columns(message.trajectory.joint_names)
            tolerances = self.follower.goal_tolerances(
                [_tolerance(each) for each in message.path_tolerance],
                [_tolerance(each) for each in message.goal_tolerance],
                message.goal_time_tolerance.to_nsec(),
            )
            self._request(message.trajectory, tolerances, goal)
        except JointsError:
            rospy.logerr(_WRONG_JOINTS)
            raise Rejection(FollowJointTrajectoryResult(error_code=ErrorCode.INVALID_JOINTS)) from None
        except TrajectoryError as error:
            _log(error)
            result = FollowJointTrajectoryResult(error_code=ErrorCode.INVALID_GOAL, error_string=str(error))
            raise Rejection(result) from None
        return goal

    def _request(
        self,
        message: JointTrajectory,
        tolerances: Sequence[JointTolerances] | None,
        goal: MonitoredGoal | None,
    ) -> None:
        """Queue a trajectory for the loop; an empty one holds the joints. Raise TrajectoryError if the trajectory is rejected."""
        if not self.follower.is_running:
            raise TrajectoryError(_NOT_RUNNING.format("commands"))
        if not message.points:
            self.follower.request_hold(goal)
            return
        points = [
            Point(each.time_from_start.to_nsec(), each.positions, each.velocities, each.accelerations)
            for each in message.points
        ]
        plan = self.follower.plan(message.joint_names, points, message.header.stamp.to_nsec(), tolerances)
        if plan.points.warning:
            rospy.logwarn("%s", plan.points.warning)
        self.follower.request_plan(plan, goal)

    def _query_state(self, request: QueryTrajectoryStateRequest) -> QueryTrajectoryStateResponse:
        if not self.follower.is_running:
            rospy.logerr("Can't sample trajectory. Controller is not running.")
            raise rospy.ServiceException("Can't sample trajectory. Controller is not running.")
        states = self.follower.sample(request.time.to_nsec())
        if states is None:
            rospy.logerr("Requested sample time precedes trajectory start time.")
            raise rospy.ServiceException("Requested sample time precedes trajectory start time.")
        positions, velocities, accelerations = zip(*states, strict=True)
        return QueryTrajectoryStateResponse(self._names, positions, velocities, accelerations)


class PositionJointTrajectoryController(JointTrajectoryController):
    """position_controllers/JointTrajectoryController: commands the desired positions."""

    interfaces = (Interface.POSITION,)

    def reset(self) -> None:
        """Command the current positions."""
        for joint, position in zip(self.joints, self.follower.positions, strict=True):
            joint.position_command = position

    def send(self, dt: float) -> None:
        """Command the desired positions."""
        for joint, position in zip(self.joints, self.follower.positions, strict=True):
            joint.position_command = position


class PosVelJointTrajectoryController(PositionJointTrajectoryController):
    """pos_vel_controllers/JointTrajectoryController: commands the desired positions and velocities."""

    interfaces = (Interface.POS_VEL,)

    def send(self, dt: float) -> None:
        """Command the desired positions and velocities."""
        super().send(dt)
        for joint, velocity in zip(self.joints, self.follower.velocities, strict=True):
            joint.velocity_command = velocity


class PosVelAccJointTrajectoryController(PosVelJointTrajectoryController):
    """pos_vel_acc_controllers/JointTrajectoryController: commands desired positions, velocities and accelerations."""

    interfaces = (Interface.POS_VEL_ACC,)

    def send(self, dt: float) -> None:
        """Command the desired positions, velocities and accelerations."""
        super().send(dt)
        for joint, acceleration in zip(self.joints, self.follower.accelerations, strict=True):
            joint.acceleration_command = acceleration


class _ClosedLoopController(JointTrajectoryController):
    """Commands ``velocity_ff/JOINT`` times the desired velocities plus the output of a PID controller with ``gains/JOINT``."""

    command: ClassVar[str]  # name of the joint attribute for the command

    def read_gains(self, context: ControllerContext) -> None:
        """Read the gains and make them configurable with dynamic_reconfigure."""
        parameters = context.parameters
        self._velocity_ff = [parameters.finite(f"velocity_ff/{name}", 0.0) for name in self._names]
        self._pids = [Pid.open(parameters.below(f"gains/{name}"), self.opened) for name in self._names]

    def reset(self) -> None:
        """Reset the PID controllers and command 0."""
        for pid, joint in zip(self._pids, self.joints, strict=True):
            pid.reset()
            setattr(joint, self.command, 0.0)

    def send(self, dt: float) -> None:
        """Command the PID controllers' output plus the feed-forward velocities."""
        follower, command = self.follower, self.command
        for joint, pid, velocity_ff, velocity, error, rate in zip(
            self.joints,
            self._pids,
            self._velocity_ff,
            follower.velocities,
            follower.position_errors,
            follower.velocity_errors,
            strict=True,
        ):
            setattr(joint, command, velocity * velocity_ff + pid.compute(error, rate, dt))


class VelocityJointTrajectoryController(_ClosedLoopController):
    """velocity_controllers/JointTrajectoryController: commands velocities."""

    interfaces = (Interface.VELOCITY,)
    command = "velocity_command"


class EffortJointTrajectoryController(_ClosedLoopController):
    """effort_controllers/JointTrajectoryController: commands efforts."""

    interfaces = (Interface.EFFORT,)
    command = "effort_command"


def _claim(hardware: Resources, name: str, interface: Interface) -> Joint:
    names = hardware.names(interface)
    if name not in names:
        raise ControllerError(f"Could not find joint '{name}' in '{interface.value}'.")
    return hardware.joint(name, interface)


def _tolerance(message: JointTolerance) -> GoalTolerance:
    return GoalTolerance(message.name, message.position, message.velocity)


def _log(error: TrajectoryError) -> None:
    """Log why a trajectory is rejected, at the same level as ROS."""
    log = rospy.logwarn if isinstance(error, PastTrajectoryError) else rospy.logerr
    log("%s", error)


def _result(outcome: Outcome) -> FollowJointTrajectoryResult:
    return FollowJointTrajectoryResult(*outcome.result)
