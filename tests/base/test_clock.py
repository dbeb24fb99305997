"""Clocks: sleeping while the test sets the time."""

from __future__ import annotations

import contextlib
import inspect
import queue
import re
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from minirospy.base import clock as clock_module
from minirospy.base.clock import (
    SignalSafeCondition,
    SignalSafeEvent,
    SignalSafeQueue,
    SimulatedClock,
    WallClock,
    time_of_clock_message,
    wait_for_event,
)
from minirospy.base.errors import ROSTimeMovedBackwardsException
from tests.interruption import ends_elsewhere

SECOND = 10**9


class Sleeping(threading.Thread):
    """A thread that sleeps with a simulated clock.

    It is waiting when the constructor returns, and again after each :meth:`at`.
    """

    def __init__(self, clock: SimulatedClock, nanoseconds: int) -> None:
        super().__init__(daemon=True)
        self.clock = clock
        self.nanoseconds = nanoseconds
        self.stop = threading.Event()
        self.waits = threading.Semaphore(0)
        self.outcome: object = None

        def wait(sleeper: SignalSafeEvent) -> None:
            self.waits.release()
            sleeper.wait(100)
            sleeper.clear()

        clock._wait = wait  # type: ignore[method-assign]
        self.start()
        assert self.waits.acquire(timeout=30)

    def run(self) -> None:
        try:
            self.outcome = self.clock.sleep(self.nanoseconds, self.stop)
        except ROSTimeMovedBackwardsException as error:
            self.outcome = error

    def at(self, now: int) -> None:
        """Set the time, and return once the thread has seen it and waits again."""
        self.clock.set(now)
        assert self.waits.acquire(timeout=30)

    def end(self) -> object:
        self.join(30)
        assert not self.is_alive()
        return self.outcome


def lines_until(step: int, is_set: bool, handle: Callable[[SignalSafeEvent], object]) -> int:
    """Set or wait for an event, and run a handler in the same thread before line number ``step``. Return the number of lines."""
    event = SignalSafeEvent()
    lines = 0

    def trace(frame: FrameType, kind: str, _: Any) -> Any:
        nonlocal lines
        if frame.f_code.co_filename in (clock_module.__file__, threading.__file__):
            lines += kind == "line"
            if kind == "line" and lines == step:
                handle(event)
            return trace
        return None

    def work() -> None:
        sys.settrace(trace)
        event.set() if is_set else event.wait(0.001)
        sys.settrace(None)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(30)
    assert not thread.is_alive(), f"the handler never ends, line {step} of what it interrupts"
    return lines


def wait_elsewhere(event: SignalSafeEvent) -> None:
    """Join a thread that waits for the event, like a hook that joins a sleeping thread."""
    thread = threading.Thread(target=event.wait, args=(0.001,), daemon=True)
    thread.start()
    thread.join()


@pytest.mark.parametrize("is_set", [False, True], ids=["wait", "set"])
@pytest.mark.parametrize("handle", [SignalSafeEvent.set, wait_elsewhere], ids=["sets", "joins"])
def test_signal_handler_may_use_an_event_at_any_moment(
    is_set: bool, handle: Callable[[SignalSafeEvent], object]
) -> None:
    """The handler runs in the thread that it interrupts, between any two lines of the event's methods."""
    step = 1
    while lines_until(step, is_set, handle) >= step:
        step += 1
    assert step > 2


def test_event_wakes_every_thread_that_waits() -> None:
    event = SignalSafeEvent()
    woken: list[bool] = []
    threads = [threading.Thread(target=lambda: woken.append(event.wait(30)), daemon=True) for _ in range(5)]
    for thread in threads:
        thread.start()
    event.set()
    for thread in threads:
        thread.join(30)
    assert woken == [True] * 5
    event.clear()
    assert not event.is_set()
    assert not event.wait(0)
    assert not event.wait(-1)


INTERRUPTED = {__file__, clock_module.__file__, contextlib.__file__, threading.__file__}


def interrupted_at(
    step: int, call: Callable[[], object], has_begun: Callable[[], object] = lambda: True
) -> bool:
    """Call a function and raise KeyboardInterrupt in it before bytecode number ``step``. Return whether it had that many.

    Count the bytecodes from the first before which ``has_begun()`` is true. The function runs in a thread, because an
    exception that is raised at the end of an ``except`` block remains the context of the thread's later ones.
    """
    results: list[bool] = []
    thread = threading.Thread(
        target=lambda: results.append(_interrupted_at(step, call, has_begun)), daemon=True
    )
    thread.start()
    thread.join(100)
    return results[0]


def _interrupted_at(step: int, call: Callable[[], object], has_begun: Callable[[], object]) -> bool:
    steps = 0

    def trace(frame: FrameType, kind: str, _: Any) -> Any:
        nonlocal steps
        # Python prints exceptions in finalizers, which the garbage collector may call here, instead of raising them.
        if frame.f_code.co_filename not in INTERRUPTED:
            return None
        frame.f_trace_opcodes = True
        if kind == "opcode" and (steps or has_begun()):
            steps += 1
        if steps == step:
            raise KeyboardInterrupt
        return trace

    frame = inspect.currentframe()
    assert frame
    frame.f_trace_opcodes = True  # Python 3.12 needs it before settrace(), too
    try:
        sys.settrace(trace)
        call()
    except KeyboardInterrupt:
        pass
    finally:
        sys.settrace(None)
    return steps >= step


def of_event() -> tuple[list[Callable[[], object]], list[Callable[[], object]]]:
    event = SignalSafeEvent()
    return [lambda: event.wait(0.0001), event.set], [event.set, event.wait]


def of_condition() -> tuple[list[Callable[[], object]], list[Callable[[], object]]]:
    condition = SignalSafeCondition()
    waits: list[Callable[[], object]] = [
        lambda: condition.wait_for(lambda: False, 0.0001),
        condition.notify_all,
    ]
    return waits, [condition.notify_all, lambda: condition.wait_for(lambda: True)]


def of_queue() -> tuple[list[Callable[[], object]], list[Callable[[], object]]]:
    items: SignalSafeQueue[int] = SignalSafeQueue(4)
    items.put(1)
    return [lambda: items.get(1), lambda: items.put(2, 1)], [lambda: items.put(3), items.get]


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("make", [of_event, of_condition, of_queue])
def test_interrupted_thread_leaves_the_others_free(
    make: Callable[[], tuple[list[Callable[[], object]], list[Callable[[], object]]]], number: int
) -> None:
    """Interrupt each method at every bytecode, as Ctrl-C could; other threads can then use the object."""
    step = 1
    while True:
        interrupted, afterwards = make()
        if not interrupted_at(step, interrupted[number]):
            break
        for call in afterwards:
            assert ends_elsewhere(call), f"the other thread waits forever, step {step}"
        step += 1
    assert step > 5


def waiting_in(waited_for: object) -> list[Any]:
    """Return the list of waiting threads: the only list among the attributes of an event or a condition."""
    (waiting,) = (value for value in vars(waited_for).values() if isinstance(value, list))
    return waiting


def test_interrupted_wait_leaves_no_entry_in_the_list() -> None:
    event, condition = SignalSafeEvent(), SignalSafeCondition()
    assert interrupted_at(1, lambda: event.wait(0), lambda: waiting_in(event))
    assert waiting_in(event) == []
    assert interrupted_at(1, lambda: condition.wait_for(lambda: False, 0), lambda: waiting_in(condition))
    assert waiting_in(condition) == []


def all_wake_from_event(step: int) -> bool:
    """Let threads wait for an event, and interrupt set() at bytecode ``step``. Return whether it had that many."""
    event = SignalSafeEvent()
    threads = [threading.Thread(target=event.wait, daemon=True) for _ in range(3)]
    for thread in threads:
        thread.start()
    is_interrupted = interrupted_at(step, event.set, event.is_set)
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads), f"a thread sleeps forever, step {step}"
    return is_interrupted


def all_wake_from_condition(step: int) -> bool:
    """Let threads wait for a condition, and interrupt notify_all() at bytecode ``step``. Return whether it had that many."""
    condition = SignalSafeCondition()
    is_over = False
    called = threading.Semaphore(0)

    def predicate() -> bool:
        called.release()
        return is_over

    threads = [threading.Thread(target=condition.wait_for, args=(predicate,), daemon=True) for _ in range(3)]
    for thread in threads:
        thread.start()
    for _ in range(6):  # each thread calls its predicate before and after it enters the list
        assert called.acquire(timeout=60)
    events = waiting_in(condition).copy()
    is_over = True
    is_interrupted = interrupted_at(
        step, condition.notify_all, lambda: any(event.is_set() for event in events)
    )
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads), f"a thread sleeps forever, step {step}"
    return is_interrupted


@pytest.mark.parametrize("all_wake", [all_wake_from_event, all_wake_from_condition])
def test_interrupted_call_wakes_all_threads(all_wake: Callable[[int], bool]) -> None:
    """Interrupt set() or notify_all() at each bytecode after it has begun to wake threads."""
    step = 1
    while all_wake(step):
        step += 1
    assert step > 5


def queue_keeps_its_size(step: int) -> bool:
    """Interrupt get() and put() at bytecode ``step``, as often as the queue has places. Return whether get() had that many."""
    size = 2
    items: SignalSafeQueue[int] = SignalSafeQueue(size)
    for number in range(size):
        items.put(number)
    is_interrupted = [interrupted_at(step, lambda: items.get(0)) for _ in range(size)]
    with contextlib.suppress(queue.Full):
        for _ in range(size):
            interrupted_at(step, lambda: items.put(5, 0))
    with contextlib.suppress(queue.Empty):
        while True:
            items.get(0)
    for number in range(size):
        items.put(number, 0)
    with pytest.raises(queue.Full):
        items.put(size, 0)
    assert [items.get(0) for _ in range(size)] == list(range(size))
    return any(is_interrupted)


def waiting_put_ends(step: int) -> bool:
    """Let a thread wait to put an item, and interrupt get() at bytecode ``step``. Return whether it had that many."""
    items: SignalSafeQueue[int] = SignalSafeQueue(1)
    items.put(1)
    putting = threading.Thread(target=items.put, args=(2,), daemon=True)
    putting.start()
    is_interrupted = interrupted_at(step, lambda: items.get(60))
    assert items.get(60) in (1, 2)
    putting.join(60)
    assert not putting.is_alive(), f"the thread waits forever, step {step}"
    return is_interrupted


@pytest.mark.parametrize("survives", [queue_keeps_its_size, waiting_put_ends])
def test_queue_survives_interrupted_calls(survives: Callable[[int], bool]) -> None:
    step = 1
    while survives(step):
        step += 1
    assert step > 5


UNSAFE = re.compile(
    r"\bthreading\.Event\(\)|=threading\.(?:Event|Condition)\b|\bqueue\.(?:Lifo|Priority)?Queue\("
    r"|^ *from threading import (?:\([^)]*|.*)\b(?:Event|Condition)\b"
    r"|^ *from queue import (?:\([^)]*|.*)\b(?:Lifo|Priority)?Queue\b",
    re.MULTILINE,
)
CONDITION = re.compile(r"(\S+)(?:: \S+)? = threading\.Condition\((.*)\)$", re.MULTILINE)
SOURCES = Path(clock_module.__file__).parents[1]


def unsafe_waits(text: str) -> list[str]:
    found = UNSAFE.findall(text)
    for name, lock in CONDITION.findall(text) if "threading.Condition(" in text else ():
        if not lock or f"with {name}:" in text:
            found.append(name)
    return found


def test_no_module_waits_where_ctrl_c_would_leave_a_lock_locked() -> None:
    """Use SignalSafeEvent and SignalSafeQueue. Enter a Condition's lock, which is written in C, not the Condition.

    This finds constructors; it does not check which thread waits on a Condition.
    """
    assert unsafe_waits("self.a = threading.Event()\nself.b = queue.Queue(3)\nc: C = threading.Condition()\n")
    for unsafe in (
        "a: threading.Event = field(default_factory=threading.Event)\n",
        "a: C = field(default_factory=threading.Condition, repr=False)\n",
        "    from threading import Event\n",
        "from threading import Lock, Condition as C\n",
        "from threading import (\n    Event,\n)\n",
        "from queue import Empty, Queue\n",
    ):
        assert unsafe_waits(unsafe), unsafe
    assert not unsafe_waits("from threading import Lock, Thread\nfrom queue import Empty, SimpleQueue\n")
    assert unsafe_waits("self.a = threading.Condition(self.b)\nwith self.a:\n    pass\n") == ["self.a"]
    assert not unsafe_waits("self.a = threading.Condition(self.b)\nwith self.b:\n    self.a.wait()\n")
    found = {
        path.relative_to(SOURCES).as_posix(): unsafe
        for path in SOURCES.rglob("*.py")
        if (unsafe := unsafe_waits(path.read_text(encoding="utf-8")))
    }
    # ROS's API has this condition. The clock is set by threads that no signal interrupts.
    assert not found.keys() - {"base/clock.py", "client/session.py"}, found


def test_condition_wakes_each_thread_whose_predicate_becomes_true() -> None:
    condition = SignalSafeCondition()
    reached = 0
    woken: list[int] = []

    def wait(number: int) -> None:
        assert condition.wait_for(lambda: reached >= number, 30)
        woken.append(number)

    threads = [threading.Thread(target=wait, args=(number,), daemon=True) for number in (1, 1, 2)]
    for thread in threads:
        thread.start()
    reached = 1
    condition.notify_all()
    for thread in threads[:2]:
        thread.join(30)
    assert woken == [1, 1]
    reached = 2
    condition.notify_all()
    threads[2].join(30)
    assert woken == [1, 1, 2]
    assert not condition.wait_for(lambda: False, 0)
    assert not condition.wait_for(lambda: False, -1)
    assert condition.wait_for(lambda: 1, 0) is True


def test_queue_keeps_the_order_and_its_size() -> None:
    items: SignalSafeQueue[int] = SignalSafeQueue(2)
    with pytest.raises(queue.Empty):
        items.get(0)
    items.put(1)
    items.put(2)
    with pytest.raises(queue.Full):
        items.put(3, 0)
    assert items.get() == 1
    items.put(3, 0)
    assert [items.get(0), items.get(0)] == [2, 3]
    putting = threading.Thread(target=lambda: [items.put(number) for number in range(20)], daemon=True)
    putting.start()
    assert [items.get(30) for _ in range(20)] == list(range(20))
    putting.join(30)


def test_wall_clock_returns_the_time() -> None:
    before = time.time_ns()
    assert before <= WallClock().now() <= time.time_ns()


def test_wall_clock_sleeps() -> None:
    start_time = time.monotonic()
    assert WallClock().sleep(SECOND // 50, threading.Event())
    assert time.monotonic() - start_time >= 0.019
    assert WallClock().sleep(-SECOND, threading.Event())


def test_stop_ends_a_sleep_on_wall_time() -> None:
    stop = threading.Event()
    stop.set()
    assert not WallClock().sleep(60 * SECOND, stop)


def test_wait_for_event() -> None:
    event = threading.Event()
    assert not wait_for_event(event, 0)
    event.set()
    assert wait_for_event(event, None)


def test_simulated_sleep_ends_at_its_time() -> None:
    clock = SimulatedClock(10 * SECOND)
    sleeping = Sleeping(clock, 2 * SECOND)
    sleeping.at(12 * SECOND - 1)
    clock.set(12 * SECOND)
    assert sleeping.end() is True


def test_sleep_before_the_first_time_starts_at_it() -> None:
    clock = SimulatedClock()
    sleeping = Sleeping(clock, SECOND)
    sleeping.at(100 * SECOND)
    clock.set(101 * SECOND)
    assert sleeping.end() is True


def test_silent_clock_is_reported_once(monkeypatch: pytest.MonkeyPatch) -> None:
    reports: list[str] = []
    clock = SimulatedClock(on_silence=lambda: reports.append("silent"))
    monkeypatch.setattr(clock_module, "SILENT_SECONDS", 1000.0)
    sleeping = Sleeping(clock, SECOND)
    sleeping.at(0)
    assert reports == []
    monkeypatch.setattr(clock_module, "SILENT_SECONDS", 0.0)
    sleeping.at(0)
    sleeping.at(0)
    assert reports == ["silent"]
    sleeping.at(5 * SECOND)
    clock.set(6 * SECOND)
    assert sleeping.end() is True


@pytest.mark.parametrize("now", [5 * SECOND, 0])
def test_time_that_jumps_back_raises(now: int) -> None:
    clock = SimulatedClock(10 * SECOND)
    sleeping = Sleeping(clock, 2 * SECOND)
    clock.set(now)
    error = sleeping.end()
    assert isinstance(error, ROSTimeMovedBackwardsException)
    assert error.time == 10 - now / 1e9


def test_time_that_jumps_back_within_a_sleep_prolongs_it() -> None:
    clock = SimulatedClock(10 * SECOND)
    sleeping = Sleeping(clock, 5 * SECOND)
    sleeping.at(14 * SECOND)
    sleeping.at(10 * SECOND)
    sleeping.at(13 * SECOND)
    clock.set(15 * SECOND)
    assert sleeping.end() is True

    sleeping = Sleeping(clock, 5 * SECOND)
    sleeping.at(19 * SECOND)
    clock.set(12 * SECOND)
    error = sleeping.end()
    assert isinstance(error, ROSTimeMovedBackwardsException)
    assert error.time == 3


def test_stop_ends_a_simulated_sleep() -> None:
    for clock in (SimulatedClock(), SimulatedClock(SECOND)):
        sleeping = Sleeping(clock, SECOND)
        sleeping.stop.set()
        clock.set(clock.now())
        assert sleeping.end() is False


def test_sleep_of_zero_takes_no_time() -> None:
    assert SimulatedClock(SECOND).sleep(0, threading.Event())
    assert SimulatedClock(SECOND).sleep(-5, threading.Event())


@pytest.mark.parametrize(
    ("body", "nanoseconds"),
    [(b"\x02\0\0\0\x05\0\0\0", 2_000_000_005), (b"\x02\0\0\0", None), (b"", None), (bytes(12), None)],
)
def test_time_of_a_clock_message_is_read_from_its_bytes(body: bytes, nanoseconds: int | None) -> None:
    assert time_of_clock_message(body) == nanoseconds
    assert time_of_clock_message(memoryview(body)) == nanoseconds
