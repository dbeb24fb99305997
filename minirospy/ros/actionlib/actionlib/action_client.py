"""Provides the names in ROS's module actionlib.action_client."""

from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from std_msgs.msg import Header

from minirospy.ros.actionlib.actionlib.client import ActionClient
from minirospy.ros.actionlib.actionlib.machine import ClientGoalHandle, CommStateMachine, GoalManager
from minirospy.ros.actionlib.actionlib.spec import ActionException
from minirospy.ros.actionlib.actionlib.states import (
    INVALID_TRANSITION,
    NO_TRANSITION,
    CommState,
    TerminalState,
    g_goal_id,
    get_name_of_constant,
)

__all__ = [
    "INVALID_TRANSITION",
    "NO_TRANSITION",
    "ActionClient",
    "ActionException",
    "ClientGoalHandle",
    "CommState",
    "CommStateMachine",
    "GoalID",
    "GoalManager",
    "GoalStatus",
    "GoalStatusArray",
    "Header",
    "TerminalState",
    "g_goal_id",
    "get_name_of_constant",
]
