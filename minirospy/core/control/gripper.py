"""The decisions of a GripperActionController: the command for the gripper, and whether a goal is reached or stalled.

Times are in nanoseconds. Source: http://wiki.ros.org/gripper_action_controller.
"""

from __future__ import annotations

from typing import NamedTuple

from minirospy.core.control.goal import MonitoredGoal, Outcome
from minirospy.core.graph.goals import GoalEvent

__all__ = ["Gripper", "GripperCommand", "GripperLimits"]


class GripperLimits(NamedTuple):
    """The conditions under which a goal is reached and a gripper counts as stalled. The defaults are ROS's."""

    goal_tolerance: float = 0.01  # rad or m
    max_effort: float = 0.0  # N m or N; the maximum effort if no goal specifies one
    stall_velocity: float = 0.001  # rad/s or m/s; a slower gripper counts as not moving
    stall_timeout: int = 1_000_000_000  # ns without motion after which the goal is aborted


class GripperCommand(NamedTuple):
    """The position to hold, the maximum effort, the goal that requested them (None: no goal), and the goal's time of receipt."""

    position: float
    max_effort: float
    goal: MonitoredGoal | None = None
    received: int = 0


class Gripper:
    """Follows commands. Other threads replace ``command``; the loop's thread calls :meth:`hold` and :meth:`check`."""

    def __init__(self, limits: GripperLimits) -> None:
        self.limits = limits
        self.command = GripperCommand(0.0, limits.max_effort)
        self._checked: MonitoredGoal | None = None
        self._moved = 0  # ns; the time of the gripper's last motion, or of its goal's receipt

    def hold(self, position: float) -> None:
        """Command a position without a goal."""
        self.command = GripperCommand(position, self.limits.max_effort)

    def check(self, time: int, position: float, velocity: float, effort: float) -> GripperCommand:
        """Finish the goal if it is reached or stalled; return this cycle's command. ``effort``: the effort of the last cycle."""
        command = self.command
        goal = command.goal
        if goal is not self._checked:
            self._checked, self._moved = goal, command.received
        if goal is None or goal.outcome is not None:
            return command

        # The result's fields: position, effort, stalled, reached_goal.
        if abs(command.position - position) < self.limits.goal_tolerance:
            goal.finish(Outcome(GoalEvent.SUCCEED, (position, effort, False, True)))
        elif abs(velocity) > self.limits.stall_velocity or time < self._moved:
            self._moved = time
        elif time - self._moved > self.limits.stall_timeout:
            goal.finish(Outcome(GoalEvent.ABORT, (position, effort, True, False)))
        return command
