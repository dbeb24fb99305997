"""The names of actionlib.action_server."""

from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray

from minirospy.ros.actionlib.actionlib import (
    ActionException,
    ActionServer,
    GoalIDGenerator,
    HandleTrackerDeleter,
    ServerGoalHandle,
    StatusTracker,
    nop_cb,
)

__all__ = [
    "ActionException",
    "ActionServer",
    "GoalID",
    "GoalIDGenerator",
    "GoalStatus",
    "GoalStatusArray",
    "HandleTrackerDeleter",
    "ServerGoalHandle",
    "StatusTracker",
    "nop_cb",
]
