"""The names of actionlib.action_client."""

from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from std_msgs.msg import Header

from minirospy.ros.actionlib.actionlib import (
    INVALID_TRANSITION,
    NO_TRANSITION,
    ActionClient,
    ActionException,
    ClientGoalHandle,
    CommState,
    CommStateMachine,
    GoalManager,
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
