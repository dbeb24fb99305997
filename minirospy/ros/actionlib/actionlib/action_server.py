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
from minirospy.ros.submodules import modules_on_first_use

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

__getattr__ = modules_on_first_use("actionlib.action_server", "rospy threading")
