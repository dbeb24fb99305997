"""The state tables of a goal: complete, and without transitions out of final states."""

from __future__ import annotations

import pytest

from minirospy.core.graph.goals import (
    CLIENT_STEPS,
    SERVER_STEPS,
    SIMPLE_STEPS,
    TERMINAL,
    ClientState,
    GoalEvent,
    GoalState,
    SimpleState,
    SimpleStep,
    client_steps,
    is_meant,
    visible_state,
)

REPORTED = [state for state in GoalState if state is not GoalState.LOST]


def test_every_event_has_its_row() -> None:
    assert set(SERVER_STEPS) == set(GoalEvent)
    assert set(CLIENT_STEPS) == set(ClientState) - {ClientState.LOST}
    assert set(SIMPLE_STEPS) == set(SimpleState)
    assert all(set(row) == set(ClientState) for row in SIMPLE_STEPS.values())


def test_a_server_moves_no_goal_on_that_has_ended() -> None:
    assert not [state for row in SERVER_STEPS.values() for state in row if state in TERMINAL]


def test_every_end_can_be_reached_and_from_everywhere_an_end() -> None:
    reached = {GoalState.PENDING}
    while (
        more := {to for row in SERVER_STEPS.values() for state, to in row.items() if state in reached}
        - reached
    ):
        reached |= more
    assert reached == set(REPORTED)
    for state in reached - TERMINAL:
        assert any(row.get(state) in TERMINAL for row in SERVER_STEPS.values())


def test_client_without_status_accepts_every_status() -> None:
    for status in REPORTED:
        steps = client_steps(ClientState.WAITING_FOR_GOAL_ACK, status)
        assert steps
        if status in TERMINAL:
            assert steps[-1] is ClientState.WAITING_FOR_RESULT


@pytest.mark.parametrize("event", GoalEvent)
@pytest.mark.parametrize(
    "before", [GoalState.PENDING, GoalState.ACTIVE, GoalState.RECALLING, GoalState.PREEMPTING]
)
def test_a_client_follows_each_step_of_a_server(before: GoalState, event: GoalEvent) -> None:
    """For any transition on the server, a client that has received the previous status accepts the next one."""
    after = SERVER_STEPS[event].get(before)
    if after is None:
        return
    state = ClientState.WAITING_FOR_GOAL_ACK
    for status in (before, after):
        steps = client_steps(state, status)
        assert steps is not None
        state = steps[-1] if steps else state


def test_client_waiting_for_a_cancel_accepts_every_status() -> None:
    assert all(client_steps(ClientState.WAITING_FOR_CANCEL_ACK, status) is not None for status in REPORTED)


def test_what_no_server_tells_is_told_from_what_cannot_follow() -> None:
    with pytest.raises(KeyError):
        client_steps(ClientState.ACTIVE, GoalState.LOST)
    with pytest.raises(KeyError):
        client_steps(ClientState.ACTIVE, 77)
    assert client_steps(ClientState.ACTIVE, GoalState.PENDING) is None
    assert client_steps(ClientState.ACTIVE, GoalState.ACTIVE) == ()


def test_the_simple_client_is_active_once_and_done_once() -> None:
    for simple in SimpleState:
        for step in SIMPLE_STEPS[simple].values():
            if step is SimpleStep.ACTIVATE:
                assert simple is SimpleState.PENDING
            if step is SimpleStep.FINISH:
                assert simple is not SimpleState.DONE


def test_a_goal_that_is_being_cancelled_looks_as_before() -> None:
    assert visible_state(GoalState.PREEMPTING) == GoalState.ACTIVE
    assert visible_state(GoalState.RECALLING) == GoalState.PENDING
    assert visible_state(GoalState.SUCCEEDED) == GoalState.SUCCEEDED
    assert visible_state(55) == 55


@pytest.mark.parametrize(
    ("cancel_id", "cancel_stamp", "means"),
    [("", 0, "abc"), ("a", 0, "a"), ("", 20, "ab"), ("c", 10, "ac"), ("d", 0, ""), ("", 5, "")],
)
def test_which_goals_a_cancel_means(cancel_id: str, cancel_stamp: int, means: str) -> None:
    goals = {"a": 10, "b": 20, "c": 30}
    assert "".join(id for id, stamp in goals.items() if is_meant(cancel_id, cancel_stamp, id, stamp)) == means
