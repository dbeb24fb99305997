"""Provides the names in ROS's module actionlib.action_server."""

from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray

from minirospy.ros.actionlib.actionlib.goal_id import GoalIDGenerator
from minirospy.ros.actionlib.actionlib.handle import HandleTrackerDeleter, ServerGoalHandle, StatusTracker
from minirospy.ros.actionlib.actionlib.server import ActionServer, nop_cb
from minirospy.ros.actionlib.actionlib.spec import ActionException

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
