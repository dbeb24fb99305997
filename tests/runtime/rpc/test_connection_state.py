"""The transitions of a server's connection: the table only, without sockets."""

from __future__ import annotations

import pytest

from minirospy.runtime.rpc.connection_state import READING, TRANSITIONS, Event, State


def reached(start: State) -> set[State]:
    """Return the states that a connection may reach from ``start``."""
    found: set[State] = set()
    new = {start}
    while new:
        new = {table[state] for table in TRANSITIONS.values() for state in new if state in table} - found
        found |= new
    return found


def test_every_event_is_in_the_table_and_changes_some_state() -> None:
    assert set(TRANSITIONS) == set(Event)
    assert all(TRANSITIONS.values())
    assert not [
        (event, state) for event, table in TRANSITIONS.items() for state in table if table[state] is state
    ]


def test_every_state_is_reached() -> None:
    assert reached(State.OPEN) == set(State)


@pytest.mark.parametrize("state", [state for state in State if state is not State.ENDED])
def test_every_state_can_end(state: State) -> None:
    assert TRANSITIONS[Event.END][state] is State.ENDED


@pytest.mark.parametrize("state", [State.CLOSING, State.REFUSED])
def test_nothing_is_answered_after_a_refusal_or_the_last_answer(state: State) -> None:
    assert reached(state) == {State.ENDED}


def test_ended_is_final() -> None:
    assert not reached(State.ENDED)


@pytest.mark.parametrize(
    ("stop", "resume"), [(Event.PIPELINED, Event.ANSWERED), (Event.UNREAD, Event.DRAINED)]
)
def test_reading_stops_and_resumes(stop: Event, resume: Event) -> None:
    stopped = TRANSITIONS[stop][State.OPEN]
    assert State.OPEN in READING
    assert stopped not in READING
    assert TRANSITIONS[resume][stopped] is State.OPEN


def test_refused_client_is_still_read() -> None:
    """Closing a socket with unread bytes would reset the connection before the client has received its response."""
    assert all(state in READING for state in TRANSITIONS[Event.REFUSE].values())
