"""actionlib.simple_action_client, provided by minirospy."""

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
