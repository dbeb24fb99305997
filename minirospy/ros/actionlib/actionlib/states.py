"""The state constants of an action client, under the names that user code expects."""

from __future__ import annotations

from actionlib_msgs.msg import GoalStatus

from minirospy.core.graph.goals import ClientState, GoalState, SimpleState

__all__ = [
    "INVALID_TRANSITION",
    "NO_TRANSITION",
    "CommState",
    "SimpleGoalState",
    "TerminalState",
    "g_goal_id",
    "get_name_of_constant",
]

NO_TRANSITION, INVALID_TRANSITION = -1, -2
"""Entries in the transition table of ROS's client: the status changes nothing, or the status is invalid.

minirospy's table is in :mod:`minirospy.core.graph.goals`. Programs may use these names after `from actionlib import *`.
"""
g_goal_id = 1  # unused; ROS's `from actionlib import *` exports it


def get_name_of_constant(C: type, n: int) -> str:
    """Return the name of the class constant with this value, or a name such as ``NO_SUCH_STATE_77`` if there is none."""
    for name, value in vars(C).items():
        # ``type(value) is int`` excludes bool constants, which some message classes have.
        if type(value) is int and value == n and not name.startswith("_"):
            return name
    return f"NO_SUCH_STATE_{n}"


class CommState:
    """The communication states of a client's goal."""

    WAITING_FOR_GOAL_ACK = int(ClientState.WAITING_FOR_GOAL_ACK)
    PENDING = int(ClientState.PENDING)
    ACTIVE = int(ClientState.ACTIVE)
    WAITING_FOR_RESULT = int(ClientState.WAITING_FOR_RESULT)
    WAITING_FOR_CANCEL_ACK = int(ClientState.WAITING_FOR_CANCEL_ACK)
    RECALLING = int(ClientState.RECALLING)
    PREEMPTING = int(ClientState.PREEMPTING)
    DONE = int(ClientState.DONE)
    LOST = int(ClientState.LOST)

    @classmethod
    def to_string(cls, n: int) -> str:
        """Return a state's name."""
        return get_name_of_constant(cls, n)


class TerminalState:
    """A goal's final states."""

    RECALLED = int(GoalState.RECALLED)
    REJECTED = int(GoalState.REJECTED)
    PREEMPTED = int(GoalState.PREEMPTED)
    ABORTED = int(GoalState.ABORTED)
    SUCCEEDED = int(GoalState.SUCCEEDED)
    LOST = int(GoalState.LOST)

    @classmethod
    def to_string(cls, n: int) -> str:
        """Return a state's name."""
        return get_name_of_constant(cls, n)


class SimpleGoalState:
    """The states of the simple client's goal."""

    PENDING = int(SimpleState.PENDING)
    ACTIVE = int(SimpleState.ACTIVE)
    DONE = int(SimpleState.DONE)

    @classmethod
    def to_string(cls, n: int) -> str:
        """Return a state's name."""
        return get_name_of_constant(cls, n)


# As in ROS's actionlib, allow `GoalStatus.to_string(client.get_state())`.
GoalStatus.to_string = classmethod(get_name_of_constant)  # type: ignore[attr-defined]
