"""The thread that stops actuators: deadlines, with a clock that the test controls."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

import pytest

from minirospy.base.errors import BridgeError
from minirospy.runtime.stop_guard import StopGuard
from tests.waiting import wait_until


class Clock:
    """A clock that the test sets."""

    def __init__(self) -> None:
        self.now = 10.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def guard(clock: Clock) -> Iterator[StopGuard]:
    guard = StopGuard(clock)
    yield guard
    for stop in list(guard.deadlines):
        guard.disarm(stop)
    # An earlier deadline wakes the thread, which then exits.
    guard.arm(_nothing, float("-inf"))
    wait_until(lambda: guard.thread is None)


def _nothing() -> None:
    pass


def stops(names: list[str], name: str) -> Callable[[], None]:
    return lambda: names.append(name)


def test_silent_item_is_stopped_once_in_another_thread(guard: StopGuard, clock: Clock) -> None:
    threads: list[str] = []
    called = threading.Event()

    def stop() -> None:
        threads.append(threading.current_thread().name)
        called.set()

    guard.arm(stop, clock.now)
    assert called.wait(60)
    assert threads == ["stop-guard"]
    wait_until(lambda: guard.thread is None)
    assert threads == ["stop-guard"]


def test_deadlines_that_are_moved_or_removed_stop_nothing(guard: StopGuard, clock: Clock) -> None:
    names: list[str] = []
    moved, removed = stops(names, "moved"), stops(names, "removed")
    guard.arm(moved, clock.now + 1000)
    guard.arm(removed, clock.now + 1000)
    guard.arm(moved, clock.now + 3000)
    guard.disarm(removed)
    guard.disarm(removed)
    # An item with an earlier deadline must not wait behind the others.
    guard.arm(stops(names, "early"), clock.now)
    wait_until(lambda: names == ["early"])
    clock.now += 2000
    guard.arm(stops(names, "second"), 0.0)
    wait_until(lambda: names == ["early", "second"])
    clock.now += 2000
    guard.arm(stops(names, "third"), 0.0)
    wait_until(lambda: len(names) == 4)
    assert sorted(names) == ["early", "moved", "second", "third"]


def test_fault_of_one_does_not_prevent_stopping_others(
    guard: StopGuard, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    names: list[str] = []

    def fail() -> None:
        raise ValueError("a fault")

    clock.now = 0.0
    guard.arm(fail, 5.0)
    guard.arm(stops(names, "other"), 6.0)
    clock.now = 10.0
    guard.arm(_nothing, 1.0)
    wait_until(lambda: names == ["other"])
    assert "a fault" in caplog.text


def test_nothing_is_driven_without_a_thread(guard: StopGuard, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_: object) -> None:
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patched:
        patched.setattr(threading.Thread, "start", refuse)
        with pytest.raises(BridgeError, match="nothing is driven: no thread"):
            guard.arm(_nothing, 0.0)
    assert not guard.deadlines
