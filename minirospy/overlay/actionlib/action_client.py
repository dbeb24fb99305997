"""actionlib.action_client, filled in by minirospy."""

from minirospy.actionlib import (
    ActionClient,
    ClientGoalHandle,
    CommState,
    CommStateMachine,
    GoalManager,
    TerminalState,
    get_name_of_constant,
)

__all__ = [
    "ActionClient",
    "ClientGoalHandle",
    "CommState",
    "CommStateMachine",
    "GoalManager",
    "TerminalState",
    "get_name_of_constant",
]
