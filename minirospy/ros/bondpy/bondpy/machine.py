"""The state machine of a bond: transitions and their actions. Pure; based on http://wiki.ros.org/bond."""

from __future__ import annotations

import enum

__all__ = ["Action", "Event", "State", "next_state"]


class State(enum.Enum):
    """A bond's state. The values are the names shown by ``repr(bond)``."""

    WAITING = "SM.WaitingForSister"
    ALIVE = "SM.Alive"
    AWAIT_DEATH = "SM.AwaitSisterDeath"
    DEAD = "SM.Dead"


class Event(enum.Enum):
    """An event in a bond's lifetime."""

    SISTER_ALIVE = enum.auto()
    SISTER_DEAD = enum.auto()
    DIE = enum.auto()
    CONNECT_TIMEOUT = enum.auto()
    HEARTBEAT_TIMEOUT = enum.auto()
    DISCONNECT_TIMEOUT = enum.auto()


class Action(enum.Enum):
    """An action to perform after a transition."""

    CONNECTED = enum.auto()
    HEARTBEAT = enum.auto()
    SISTER_DIED = enum.auto()
    START_DYING = enum.auto()
    DEATH = enum.auto()


_TABLE: dict[tuple[State, Event], tuple[State, tuple[Action, ...]]] = {
    # The first message counts as a heartbeat, so that a peer that exits right after sending it is detected.
    (State.WAITING, Event.SISTER_ALIVE): (State.ALIVE, (Action.CONNECTED, Action.HEARTBEAT)),
    (State.WAITING, Event.SISTER_DEAD): (State.DEAD, (Action.CONNECTED, Action.SISTER_DIED, Action.DEATH)),
    (State.WAITING, Event.CONNECT_TIMEOUT): (State.DEAD, (Action.DEATH,)),
    (State.WAITING, Event.DIE): (State.DEAD, (Action.DEATH,)),
    (State.ALIVE, Event.SISTER_ALIVE): (State.ALIVE, (Action.HEARTBEAT,)),
    (State.ALIVE, Event.SISTER_DEAD): (State.DEAD, (Action.SISTER_DIED, Action.DEATH)),
    (State.ALIVE, Event.HEARTBEAT_TIMEOUT): (State.DEAD, (Action.DEATH,)),
    (State.ALIVE, Event.DIE): (State.AWAIT_DEATH, (Action.START_DYING,)),
    (State.AWAIT_DEATH, Event.SISTER_DEAD): (State.DEAD, (Action.DEATH,)),
    (State.AWAIT_DEATH, Event.DISCONNECT_TIMEOUT): (State.DEAD, (Action.DEATH,)),
}


def next_state(state: State, event: Event) -> tuple[State, tuple[Action, ...]]:
    """Return the next state and the actions to perform. An event without a transition leaves the state unchanged."""
    return _TABLE.get((state, event), (state, ()))
