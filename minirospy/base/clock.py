"""Clocks: the current time, and waiting until a given time.

There is a wall clock, and a simulated clock that other code sets (http://wiki.ros.org/Clock). Times are
nanoseconds since the epoch.

The main thread uses SignalSafeEvent, SignalSafeCondition and SignalSafeQueue instead of the classes of threading and queue.
Those are written in Python: an exception from a signal handler, such as KeyboardInterrupt, can interrupt them after they have
acquired their lock and before the block that releases it. The lock then stays locked, and other threads wait forever.
docs/architecture.md lists the exceptions.
"""

from __future__ import annotations

import contextlib
import functools
import queue
import struct
import sys
import threading
import time
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from minirospy.base.errors import ROSTimeMovedBackwardsException

__all__ = [
    "SILENT_CLOCK",
    "Clock",
    "FirstTimeWait",
    "SignalSafeCondition",
    "SignalSafeEvent",
    "SignalSafeQueue",
    "SimulatedClock",
    "WallClock",
    "time_of_clock_message",
    "wait_for_event",
]

_T = TypeVar("_T")
_CLOCK = struct.Struct("<II")
_SLICE = 0.05 if sys.platform == "win32" else 0.5
"""Seconds per wait in the main thread, the thread that receives signals.

On Windows, Ctrl-C does not interrupt a wait; on other systems, a Ctrl-C just before a wait is handled only after that wait.
"""

_POLL_SECONDS = 0.1
# seconds to wait for the first /clock message before warning; a simulator normally sends it sooner
SILENT_SECONDS = 2.0

SILENT_CLOCK = (
    "/use_sim_time is set, and no time has arrived on /clock yet: sleep(), Rate and Timer wait for it. Start the simulator or "
    "`rosbag play --clock`; or type `rosparam set use_sim_time false`, and restart this node"
)
"""The warning that no time has arrived on /clock."""


def _repeated_if_interrupted(method: Callable[[_T], None]) -> Callable[[_T], None]:
    """Let a method, which wakes all waiting threads, start again if a signal handler raises an exception in it.

    Otherwise some of the threads would sleep forever. The exception is raised after that.
    """

    @functools.wraps(method)
    def call(self: _T) -> None:
        try:
            method(self)
        except BaseException:
            method(self)
            raise

    return call


class SignalSafeEvent(threading.Event):
    """An event that a signal handler may set or wait for, no matter what code the signal interrupts.

    The interrupted thread may be inside wait() or set() of the same event. threading.Event acquires a lock there, so a handler
    that sets the event, or waits for another thread that needs the lock, would deadlock.
    This event has no lock, because its list operations are atomic.
    """

    def __init__(self) -> None:
        super().__init__()
        self._is_set = False
        self._waiting: list[threading.Lock] = []
        """One lock per waiting thread, held until the event is set."""

    def is_set(self) -> bool:
        """Return whether the event is set."""
        return self._is_set

    @_repeated_if_interrupted
    def set(self) -> None:
        """Set the event, and wake the waiting threads, even if a signal handler raises an exception meanwhile."""
        # Set the flag before reading the list: a waiting thread first adds itself to the list and then checks the flag.
        self._is_set = True
        for lock in self._waiting.copy():
            # Another thread, or a signal handler in this thread, has already released the lock.
            with contextlib.suppress(RuntimeError):
                lock.release()

    def clear(self) -> None:
        """Clear the event."""
        self._is_set = False

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for at most ``timeout`` seconds until the event is set; return whether it is set."""
        if self._is_set:
            return True
        lock = threading.Lock()
        lock.acquire()
        try:
            self._waiting.append(lock)
            if self._is_set:
                return True
            return lock.acquire(timeout=-1 if timeout is None else max(0.0, timeout)) or self._is_set
        finally:
            # The list lacks the lock if a signal handler raised an exception before the call of append().
            if lock in self._waiting:
                self._waiting.remove(lock)


class SignalSafeCondition:
    """A lock-free condition. Signal handlers may wait for it or notify it, no matter what code the signal interrupts."""

    def __init__(self) -> None:
        self._waiting: list[SignalSafeEvent] = []

    @_repeated_if_interrupted
    def notify_all(self) -> None:
        """Let the waiting threads call their predicates again. Call this after each change that may affect one.

        All threads are notified, even if a signal handler raises an exception meanwhile.
        """
        for event in self._waiting.copy():
            event.set()

    def wait_for(self, predicate: Callable[[], object], timeout: float | None = None) -> bool:
        """Wait for at most ``timeout`` seconds until ``predicate()`` is true; return whether it is true.

        A signal can interrupt the wait on every OS.
        """
        # Most calls need not wait, and creating an event takes longer than the call.
        if predicate():
            return True
        end = None if timeout is None else time.monotonic() + timeout
        event = SignalSafeEvent()
        try:
            self._waiting.append(event)
            while True:
                # Clear the event before the call: a change after the call sets it again.
                event.clear()
                if predicate():
                    return True
                rest = None if end is None else end - time.monotonic()
                if rest is not None and rest <= 0:
                    return False
                wait_for_event(event, rest)
        finally:
            if event in self._waiting:
                self._waiting.remove(event)


class SignalSafeQueue(Generic[_T]):
    """A queue for at most ``size`` items, which any thread may use, whichever code a signal interrupts.

    If several threads put items at the same time, each may use the last place: the queue then exceeds its size by at most
    the number of these threads minus 1.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        # SimpleQueue is written in C: a signal handler runs only before or after its calls.
        self._items: queue.SimpleQueue[_T] = queue.SimpleQueue()
        self._removed = SignalSafeCondition()

    def put(self, item: _T, timeout: float | None = None) -> None:
        """Append an item. Raise queue.Full if the queue is still full after ``timeout`` seconds."""
        if not self._removed.wait_for(lambda: self._items.qsize() < self._size, timeout):
            raise queue.Full
        self._items.put(item)

    def get(self, timeout: float | None = None) -> _T:
        """Remove and return the first item. Raise queue.Empty if there is none after ``timeout`` seconds."""
        # If an exception ended an earlier call before its notification, a thread may still wait to put an item.
        if self._items.empty():
            self._removed.notify_all()
        item = self._items.get(timeout=timeout)
        self._removed.notify_all()
        return item


def wait_for_event(event: threading.Event, timeout: float | None) -> bool:
    """Like ``event.wait(timeout)``, except that a signal can interrupt the wait on every OS."""
    if threading.current_thread() is not threading.main_thread():
        return event.wait(timeout)
    end = None if timeout is None else time.monotonic() + timeout
    while not event.is_set():
        rest = _SLICE if end is None else min(_SLICE, end - time.monotonic())
        if rest <= 0:
            return False
        event.wait(rest)
    return True


def time_of_clock_message(body: bytes | memoryview) -> int | None:
    """Return the time in a serialized /clock message, in nanoseconds, or None if it is not a rosgraph_msgs/Clock."""
    # A Clock is a single time: seconds and nanoseconds. Check the size, because a node may publish another type.
    if len(body) != _CLOCK.size:
        return None
    seconds, nanoseconds = _CLOCK.unpack(body)
    return int(seconds) * 10**9 + int(nanoseconds)


class Clock(Protocol):
    """The interface to the time used by the sleeping functions."""

    def now(self) -> int:
        """Return the current time in nanoseconds."""

    def sleep(self, nanoseconds: int, stop: threading.Event) -> bool:
        """Wait for ``nanoseconds``; return False if ``stop`` was set in the meantime."""


class WallClock:
    """A clock that returns the system time."""

    now = staticmethod(time.time_ns)
    """Return the nanoseconds since the epoch."""

    def sleep(self, nanoseconds: int, stop: threading.Event) -> bool:
        """Wait for ``nanoseconds``; return False if ``stop`` was set in the meantime."""
        return not wait_for_event(stop, max(0.0, nanoseconds / 1e9))


class FirstTimeWait:
    """Calls a function once if a simulated clock is not set within two seconds."""

    def __init__(self, on_silence: Callable[[], object]) -> None:
        self._pending = [on_silence]  # a list, because list.pop() is atomic and several threads may wait

    def check(self, started: float) -> None:
        """Call the function if the wait that began at ``started`` (in seconds of time.monotonic()) has lasted too long."""
        if self._pending and time.monotonic() - started >= SILENT_SECONDS:
            try:
                on_silence = self._pending.pop()
            except IndexError:
                return
            on_silence()


class SimulatedClock:
    """A clock set by a simulator, through /clock, or by a test."""

    def __init__(
        self,
        now: int = 0,
        changed: threading.Condition | None = None,
        on_silence: Callable[[], object] = lambda: None,
    ) -> None:
        """Create a clock set to ``now``. ``changed`` is notified each time the clock is set.

        ``on_silence()`` is called once, in a thread that has waited two seconds for the clock to be set for the first
        time.
        """
        self._now = now
        self._first = FirstTimeWait(on_silence)
        self._changed = changed or threading.Condition()
        # Sleepers do not wait on the condition, whose lock could deadlock with a signal handler that waits for another thread.
        self._sleepers: list[SignalSafeEvent] = []

    def now(self) -> int:
        """Return the time that was last set, or 0 if none was set."""
        return self._now

    def set(self, now: int) -> None:
        """Set the time, and wake the sleepers so that they check it."""
        with self._changed:
            self._now = now
            self._changed.notify_all()
        for sleeper in self._sleepers.copy():
            sleeper.set()

    def sleep(self, nanoseconds: int, stop: threading.Event) -> bool:
        """Wait until the clock has advanced by ``nanoseconds``; return False if ``stop`` was set in the meantime.

        A time of 0 means that the clock has not been set yet: the sleep then starts at the first time that is set.
        Raise ROSTimeMovedBackwardsException if the clock is set to a time before the sleep started.
        """
        sleeper = SignalSafeEvent()
        self._sleepers.append(sleeper)
        started = time.monotonic()
        try:
            while (start := self._now) == 0 and not stop.is_set():
                self._wait(sleeper)
                if self._now == 0:
                    self._first.check(started)
            while (now := self._now) < start + nanoseconds and not stop.is_set():
                if now < start:
                    raise ROSTimeMovedBackwardsException((start - now) / 1e9)
                self._wait(sleeper)
            return not stop.is_set()
        finally:
            self._sleepers.remove(sleeper)

    @staticmethod
    def _wait(sleeper: SignalSafeEvent) -> None:
        """Wait until the clock is set, or until it is time to poll the stop event, which cannot interrupt this wait."""
        sleeper.wait(_POLL_SECONDS)
        sleeper.clear()
