"""The names of actionlib.simple_action_client."""

from actionlib_msgs.msg import GoalStatus

from minirospy.ros.actionlib.actionlib import (
    ActionClient,
    CommState,
    SimpleActionClient,
    SimpleGoalState,
    get_name_of_constant,
)

__all__ = [
    "ActionClient",
    "CommState",
    "GoalStatus",
    "SimpleActionClient",
    "SimpleGoalState",
    "get_name_of_constant",
]
