"""Provides the names in ROS's module actionlib.simple_action_client."""

from actionlib_msgs.msg import GoalStatus

from minirospy.ros.actionlib.actionlib.client import ActionClient
from minirospy.ros.actionlib.actionlib.simple_client import SimpleActionClient
from minirospy.ros.actionlib.actionlib.states import CommState, SimpleGoalState, get_name_of_constant

__all__ = [
    "ActionClient",
    "CommState",
    "GoalStatus",
    "SimpleActionClient",
    "SimpleGoalState",
    "get_name_of_constant",
]
