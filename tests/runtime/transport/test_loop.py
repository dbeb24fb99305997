"""runtime/transport/loop: calls from threads to the loop while the loop is closing."""

from __future__ import annotations

import asyncio
import contextlib
import sys
import threading
from types import FrameType

import pytest

from minirospy.runtime.transport import loop as loop_module
from minirospy.runtime.transport.loop import LoopClosedError, LoopThread, new_event_loop


def test_a_call_while_the_loop_closes_gets_an_error() -> None:
    thread = LoopThread("test-loop")
    stopping, started = threading.Event(), threading.Event()

    def stop() -> None:
        thread.close()
        stopping.set()
        started.wait(30)

    thread.post(stop)
    assert stopping.wait(30)
    waits = [thread.start(asyncio.sleep(0)), thread.start(asyncio.sleep(60))]
    started.set()
    # The loop may be closing.
    with contextlib.suppress(LoopClosedError):
        waits[0](10)
    with pytest.raises(LoopClosedError):
        waits[1](10)
    with pytest.raises(LoopClosedError):
        thread.run(asyncio.sleep(0))
    thread.close()


def test_a_second_close_does_not_interrupt_the_end() -> None:
    thread = LoopThread("test-loop")
    ended: list[str] = []

    async def close_again() -> None:
        try:
            await asyncio.sleep(60)
        finally:
            thread.close()
            await asyncio.sleep(0)
            ended.append("task")

    wait = thread.start(close_again())
    thread.run(asyncio.sleep(0))
    thread.close()
    with pytest.raises(LoopClosedError):
        wait(10)
    # close() stops waiting for a thread that stalls.
    thread._thread.join(30)
    assert thread.loop.is_closed()
    assert ended == ["task"]


def test_calls_start_in_their_order() -> None:
    thread = LoopThread("test-loop")
    order: list[int] = []

    async def come(number: int) -> None:
        order.append(number)

    waits = [thread.start(come(number)) for number in range(100)]
    for wait in reversed(waits):
        wait(10)
    assert order == list(range(100))
    thread.close()


def test_a_handler_at_any_step_of_a_call_may_call_the_loop() -> None:
    """A signal handler may run between any two steps of the main thread. It shuts the node down, which waits for the loop."""
    thread = LoopThread("test-loop")
    at = 0
    # Use a list, not a counter that is rebound: before Python 3.12, a profile function's changes to its caller's
    # variables may be undone.
    steps: list[str] = []
    is_at_step = threading.Event()
    inner: list[int] = []

    async def outer() -> int:
        # Finish while the caller is at the step, for which the loop needs the lock of the caller's future. If the
        # caller waits for this call before it reaches the step, continue after a moment.
        is_at_step.wait(0.05)
        return 1

    def count(frame: FrameType, event: str, argument: object) -> None:
        steps.append(event)
        if len(steps) == at:
            is_at_step.set()
            inner.append(thread.run(asyncio.sleep(0, 2), 10.0))

    profile = sys.getprofile()
    while len(steps) >= at:
        at += 1
        steps.clear()
        is_at_step.clear()
        sys.setprofile(count)
        try:
            outcome = thread.run(outer())
        finally:
            sys.setprofile(profile)
        assert outcome == 1
    assert inner == [2] * (at - 1)
    assert at > 20
    thread.close()


def test_a_thread_that_is_interrupted_as_it_starts_closes_its_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    """At this point the thread is running, so closing its loop from outside would raise RuntimeError in it."""
    threads: list[threading.Thread] = []
    faults: list[threading.ExceptHookArgs] = []
    start = threading.Thread.start

    def interrupted(thread: threading.Thread) -> None:
        threads.append(thread)
        start(thread)
        raise KeyboardInterrupt

    monkeypatch.setattr(threading, "excepthook", faults.append)
    monkeypatch.setattr(threading.Thread, "start", interrupted)
    loop = new_event_loop()
    monkeypatch.setattr(loop_module, "new_event_loop", lambda: loop)
    with pytest.raises(KeyboardInterrupt):
        LoopThread("test-loop")
    threads[0].join(30)
    assert loop.is_closed()
    assert not faults
