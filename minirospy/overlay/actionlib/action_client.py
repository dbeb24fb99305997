"""actionlib.action_client, provided by minirospy."""

from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from std_msgs.msg import Header

from minirospy.actionlib import (
    ActionClient,
    ActionException,
    ClientGoalHandle,
    CommState,
    CommStateMachine,
    GoalManager,
    TerminalState,
    get_name_of_constant,
)

__all__ = [
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
    "get_name_of_constant",
]
