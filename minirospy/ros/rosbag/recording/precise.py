"""Waits until a given time with microsecond precision; the wait can be interrupted."""

from __future__ import annotations

import contextlib
import sys
import time

from minirospy.base.clock import SignalSafeEvent

__all__ = ["PreciseWait"]

# SignalSafeEvent.wait() is imprecise, so sleep instead for the last N ns before the deadline.
_EVENT_NS = 5_000_000

# Linux's PR_SET_TIMERSLACK: how long the kernel may delay a thread's wake-up, 50 us by default
_TIMER_SLACK = 29


class PreciseWait:
    """Waits until a time of ``time.perf_counter_ns()``, a clock that is precise on every OS.

    Only the thread that creates it may wait; any thread, and a signal handler, may call ``wake``.
    """

    def __init__(self) -> None:
        # Use an event that a signal handler can set in the thread that is waiting on it.
        self._event = SignalSafeEvent()
        self._spin_ns = 150_000
        if sys.platform.startswith("linux"):
            with contextlib.suppress(OSError, AttributeError, ImportError):
                import ctypes

                if ctypes.CDLL(None).prctl(_TIMER_SLACK, 1, 0, 0, 0) == 0:
                    self._spin_ns = 40_000

    def wake(self) -> None:
        """Interrupt the current wait; if it ends within 5 ms, interrupt the next long wait instead."""
        self._event.set()

    def until(self, wall: int) -> int:
        """Wait until time ``wall``, or until :meth:`wake` is called; return the current time."""
        while True:
            now = time.perf_counter_ns()
            rest = wall - now
            if rest <= 0:
                return now
            if rest > _EVENT_NS:
                if self._event.wait((rest - _EVENT_NS) / 1e9):
                    self._event.clear()
                    return time.perf_counter_ns()
            elif rest > self._spin_ns:
                time.sleep((rest - self._spin_ns) / 1e9)
            else:
                # Busy-poll, but release the GIL so that other threads can send messages.
                time.sleep(0)
