"""The states of an action goal, as tables: the server's transitions, and a client's transitions on received statuses.

A table contains, for a state and an event, the next state or the sequence of next states; invalid transitions are
missing. Source: http://wiki.ros.org/actionlib/DetailedDescription, and actionlib itself for details missing on that
page.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, IntEnum

__all__ = [
    "CLIENT_STEPS",
    "SERVER_STEPS",
    "SIMPLE_STEPS",
    "TERMINAL",
    "ClientState",
    "GoalEvent",
    "GoalState",
    "SimpleState",
    "SimpleStep",
    "client_steps",
    "is_meant",
    "visible_state",
]


class GoalState(IntEnum):
    """A goal's status as the server publishes it. The numbers are those in actionlib_msgs/GoalStatus."""

    PENDING = 0
    ACTIVE = 1
    PREEMPTED = 2
    SUCCEEDED = 3
    ABORTED = 4
    REJECTED = 5
    PREEMPTING = 6
    RECALLING = 7
    RECALLED = 8
    LOST = 9


class ClientState(IntEnum):
    """A goal's state in the client: actionlib.CommState."""

    WAITING_FOR_GOAL_ACK = 0
    PENDING = 1
    ACTIVE = 2
    WAITING_FOR_RESULT = 3
    WAITING_FOR_CANCEL_ACK = 4
    RECALLING = 5
    PREEMPTING = 6
    DONE = 7
    LOST = 8


class SimpleState(IntEnum):
    """A goal's state in the simple client: actionlib.SimpleGoalState."""

    PENDING = 0
    ACTIVE = 1
    DONE = 2


class GoalEvent(Enum):
    """An event that changes a goal's state. The value describes the new state, for use in messages."""

    ACCEPT = "an active state"
    CANCEL_REQUEST = "a cancel requested state"
    CANCEL = "a cancelled state"
    REJECT = "a rejected state"
    ABORT = "an aborted state"
    SUCCEED = "a succeeded state"


class SimpleStep(Enum):
    """The effect that a change of the client's state has on the simple client."""

    NONE = "nothing"
    ACTIVATE = "the goal has become active"
    FINISH = "the goal is done"
    WRONG = "this state cannot follow"


TERMINAL = frozenset(
    {
        GoalState.PREEMPTED,
        GoalState.SUCCEEDED,
        GoalState.ABORTED,
        GoalState.REJECTED,
        GoalState.RECALLED,
        GoalState.LOST,
    }
)
"""A goal's final states."""

_G = GoalState
_C = ClientState
_S = SimpleState

SERVER_STEPS: Mapping[GoalEvent, Mapping[int, GoalState]] = {
    GoalEvent.ACCEPT: {_G.PENDING: _G.ACTIVE, _G.RECALLING: _G.PREEMPTING},
    GoalEvent.CANCEL_REQUEST: {_G.PENDING: _G.RECALLING, _G.ACTIVE: _G.PREEMPTING},
    GoalEvent.CANCEL: {
        _G.PENDING: _G.RECALLED,
        _G.RECALLING: _G.RECALLED,
        _G.ACTIVE: _G.PREEMPTED,
        _G.PREEMPTING: _G.PREEMPTED,
    },
    GoalEvent.REJECT: {_G.PENDING: _G.REJECTED, _G.RECALLING: _G.REJECTED},
    GoalEvent.ABORT: {_G.PREEMPTING: _G.ABORTED, _G.ACTIVE: _G.ABORTED},
    GoalEvent.SUCCEED: {_G.PREEMPTING: _G.SUCCEEDED, _G.ACTIVE: _G.SUCCEEDED},
}
"""The server's transitions. If a state is not listed for an event, the event is invalid and the state does not change."""

_Steps = Mapping[int, tuple[ClientState, ...]]

_STAYS: tuple[ClientState, ...] = ()
_TO_RESULT = (_C.WAITING_FOR_RESULT,)
_PREEMPTED = (_C.PREEMPTING, _C.WAITING_FOR_RESULT)
_ACTIVE_PREEMPTED = (_C.ACTIVE, _C.PREEMPTING, _C.WAITING_FOR_RESULT)
_ACTIVE_RESULT = (_C.ACTIVE, _C.WAITING_FOR_RESULT)
_PENDING_RESULT = (_C.PENDING, _C.WAITING_FOR_RESULT)
_ENDED: _Steps = dict.fromkeys((_G.PREEMPTED, _G.SUCCEEDED, _G.ABORTED, _G.REJECTED, _G.RECALLED), _STAYS)

CLIENT_STEPS: Mapping[int, _Steps] = {
    _C.WAITING_FOR_GOAL_ACK: {
        _G.PENDING: (_C.PENDING,),
        _G.ACTIVE: (_C.ACTIVE,),
        _G.PREEMPTED: _ACTIVE_PREEMPTED,
        _G.SUCCEEDED: _ACTIVE_RESULT,
        _G.ABORTED: _ACTIVE_RESULT,
        _G.REJECTED: _PENDING_RESULT,
        _G.PREEMPTING: (_C.ACTIVE, _C.PREEMPTING),
        _G.RECALLING: (_C.PENDING, _C.RECALLING),
        _G.RECALLED: _PENDING_RESULT,
    },
    _C.PENDING: {
        _G.PENDING: _STAYS,
        _G.ACTIVE: (_C.ACTIVE,),
        _G.PREEMPTED: _ACTIVE_PREEMPTED,
        _G.SUCCEEDED: _ACTIVE_RESULT,
        _G.ABORTED: _ACTIVE_RESULT,
        _G.REJECTED: _TO_RESULT,
        _G.PREEMPTING: (_C.ACTIVE, _C.PREEMPTING),
        _G.RECALLING: (_C.RECALLING,),
        _G.RECALLED: (_C.RECALLING, _C.WAITING_FOR_RESULT),
    },
    _C.ACTIVE: {
        _G.ACTIVE: _STAYS,
        _G.PREEMPTED: _PREEMPTED,
        _G.SUCCEEDED: _TO_RESULT,
        _G.ABORTED: _TO_RESULT,
        _G.PREEMPTING: (_C.PREEMPTING,),
    },
    # Ignore an ACTIVE status: it may be older than the result that has already been processed.
    _C.WAITING_FOR_RESULT: {_G.ACTIVE: _STAYS, **_ENDED},
    _C.WAITING_FOR_CANCEL_ACK: {
        _G.PENDING: _STAYS,
        _G.ACTIVE: _STAYS,
        _G.PREEMPTED: _PREEMPTED,
        _G.SUCCEEDED: _PREEMPTED,
        _G.ABORTED: _PREEMPTED,
        _G.REJECTED: _TO_RESULT,
        _G.PREEMPTING: (_C.PREEMPTING,),
        _G.RECALLING: (_C.RECALLING,),
        _G.RECALLED: (_C.RECALLING, _C.WAITING_FOR_RESULT),
    },
    _C.RECALLING: {
        _G.PREEMPTED: _PREEMPTED,
        _G.SUCCEEDED: _PREEMPTED,
        _G.ABORTED: _PREEMPTED,
        _G.REJECTED: _TO_RESULT,
        _G.PREEMPTING: (_C.PREEMPTING,),
        _G.RECALLING: _STAYS,
        _G.RECALLED: _TO_RESULT,
    },
    _C.PREEMPTING: {
        _G.PREEMPTED: _TO_RESULT,
        _G.SUCCEEDED: _TO_RESULT,
        _G.ABORTED: _TO_RESULT,
        _G.PREEMPTING: _STAYS,
    },
    _C.DONE: _ENDED,
}
"""The client's transitions: the states that the client passes through, in order, when it receives a goal's status.

A client may miss a status, because each published status list replaces the previous one. Therefore a status may lead
through several states. A status that is not listed is invalid in that state.
"""

_NONE: Mapping[int, SimpleStep] = dict.fromkeys(ClientState, SimpleStep.NONE)

SIMPLE_STEPS: Mapping[int, Mapping[int, SimpleStep]] = {
    _S.PENDING: {
        **_NONE,
        _C.ACTIVE: SimpleStep.ACTIVATE,
        _C.PREEMPTING: SimpleStep.ACTIVATE,
        _C.DONE: SimpleStep.FINISH,
    },
    _S.ACTIVE: {**_NONE, _C.RECALLING: SimpleStep.WRONG, _C.DONE: SimpleStep.FINISH},
    _S.DONE: {
        **_NONE,
        _C.ACTIVE: SimpleStep.WRONG,
        _C.RECALLING: SimpleStep.WRONG,
        _C.PREEMPTING: SimpleStep.WRONG,
        _C.DONE: SimpleStep.WRONG,
    },
}
"""The simple client's transitions: a dict from its state and the client's new state to the effect."""

_VISIBLE: Mapping[int, GoalState] = {_G.PREEMPTING: _G.ACTIVE, _G.RECALLING: _G.PENDING}


def client_steps(state: int, status: int) -> tuple[ClientState, ...] | None:
    """Return the states that a client in ``state`` passes through on receiving ``status``, or None if the status is invalid.

    Raise KeyError if the status is one that servers never publish.
    """
    if status not in CLIENT_STEPS[_C.WAITING_FOR_GOAL_ACK]:
        raise KeyError(status)
    return CLIENT_STEPS[state].get(status)


def is_meant(cancel_id: str, cancel_stamp: int, goal_id: str, goal_stamp: int) -> bool:
    """Return whether a cancel request applies to a goal.

    The request applies to the goal with the request's id, to goals whose stamp is not later than the request's, or,
    without id and stamp, to all goals. Stamps are in nanoseconds; zero means none.
    """
    if not cancel_id and not cancel_stamp:
        return True
    return cancel_id == goal_id or bool(cancel_stamp and goal_stamp <= cancel_stamp)


def visible_state(status: int) -> int:
    """Return the goal's status as the simple client reports it.

    A goal that is being cancelled still counts as pending or active.
    """
    return int(_VISIBLE.get(status, status))
