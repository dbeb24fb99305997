"""The states of a bond: which event leads where, and what is to be done. Pure; written from http://wiki.ros.org/bond."""

from __future__ import annotations

import enum

__all__ = ["Action", "Event", "State", "next_state"]


class State(enum.Enum):
    """A state, by the name that ``repr(bond)`` shows."""

    WAITING = "SM.WaitingForSister"
    ALIVE = "SM.Alive"
    AWAIT_DEATH = "SM.AwaitSisterDeath"
    DEAD = "SM.Dead"


class Event(enum.Enum):
    """Something that happens to a bond."""

    SISTER_ALIVE = enum.auto()
    SISTER_DEAD = enum.auto()
    DIE = enum.auto()
    CONNECT_TIMEOUT = enum.auto()
    HEARTBEAT_TIMEOUT = enum.auto()
    DISCONNECT_TIMEOUT = enum.auto()


class Action(enum.Enum):
    """Something that is to be done."""

    CONNECTED = enum.auto()
    HEARTBEAT = enum.auto()
    SISTER_DIED = enum.auto()
    START_DYING = enum.auto()
    DEATH = enum.auto()


_TABLE: dict[tuple[State, Event], tuple[State, tuple[Action, ...]]] = {
    # The first message counts as a heartbeat: a sister that ends after it is noticed, too.
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
    """Return the state after an event, and what is to be done. An event without meaning in a state changes nothing."""
    return _TABLE.get((state, event), (state, ()))
