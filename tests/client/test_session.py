"""A session is replaced, and never reset: by a second init_node, and by a fork."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import cast

import pytest

from minirospy.base.clock import SimulatedClock
from minirospy.client import session as sessions
from minirospy.client.session import Session, current_session, replace_session, replace_session_in_fork
from minirospy.client.shutdown import Action
from minirospy.runtime.transport.loop import LoopThread
from tests.client.nudge import nudge


@pytest.fixture(autouse=True)
def session(monkeypatch: pytest.MonkeyPatch) -> Session:
    """Return a session without a node, in place of the process's session."""
    own = Session()
    monkeypatch.setattr(sessions._Process, "session", own)
    return own


def test_a_session_is_not_replaced_before_its_shutdown(session: Session) -> None:
    replace_session()
    assert current_session() is session


def test_a_session_is_not_replaced_after_a_signal(session: Session) -> None:
    session.lifecycle.machine.signal(0.0)
    session.lifecycle.signal_shutdown("test")
    replace_session()
    assert current_session() is session


def test_the_next_session_keeps_name_clock_and_listeners_alone(session: Session) -> None:
    session.identity.be_called("/one")
    session.clock = SimulatedClock(5)
    session.has_time = True
    session.parameter_listeners.append(print)
    session.init_arguments = ("one",)
    session.lifecycle.add_hook(lambda: None)
    session.lifecycle.signal_shutdown("test")

    replace_session()
    following = current_session()
    assert following is not session
    assert (following.name, following.clock, following.has_time) == ("/one", session.clock, True)
    assert following.parameter_listeners == [print]
    assert (following.init_arguments, following.node, following.lifecycle.hooks) == (None, None, [])
    assert not following.is_shutdown()
    # The old session is unchanged, for the publishers that were created in it.
    assert session.is_shutdown()


@pytest.mark.parametrize("was_down", [False, True])
def test_a_fork_keeps_the_state_and_not_the_hooks(session: Session, *, was_down: bool) -> None:
    ran: list[str] = []
    session.lifecycle.add_hook(lambda: ran.append("hook of the parent"))
    if was_down:
        session.lifecycle.signal_shutdown("test")
        ran.clear()

    replace_session_in_fork()
    assert current_session().is_fork
    assert current_session().is_shutdown() == was_down
    current_session().lifecycle.signal_shutdown("end of the fork")
    assert ran == []


def test_waiting_calls_run_once_the_node_is_ready(session: Session) -> None:
    ran: list[int] = []
    session.when_ready(lambda: ran.append(1))
    assert ran == []
    session.publish_node()
    assert ran == [1]


def test_a_signal_while_a_call_of_the_loop_starts_waits_for_its_start(session: Session) -> None:
    """At this point the thread holds a lock, for which closing the loop would wait."""
    was_requested: list[bool] = []

    class Loop:
        def start(self, coroutine: Coroutine[object, object, int]) -> Callable[[float | None], int]:
            coroutine.close()
            nudge(session.signals)
            was_requested.append(session.lifecycle.is_shutdown_requested)
            return lambda _: 7

    session._loop = cast("LoopThread", Loop())
    assert session.run(asyncio.sleep(0, 7)) == 7
    assert was_requested == [False]
    assert session.is_shutdown()


def test_a_second_signal_while_the_loop_is_made_waits_until_it_is(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[bool] = []

    def make() -> None:
        nudge(session.signals, Action.KEYBOARD_INTERRUPT)
        made.append(True)

    monkeypatch.setattr("minirospy.runtime.transport.loop.LoopThread", make)
    with pytest.raises(KeyboardInterrupt):
        session.open_node(0, 0)
    assert made == [True]
