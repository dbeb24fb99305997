"""Waits until a given time with microsecond precision; the wait can be interrupted."""

from __future__ import annotations

import contextlib
import sys
import time

from minirospy.base.clock import SignalSafeEvent

__all__ = ["PreciseWait"]

# Time in ns before the deadline at which to switch from SignalSafeEvent.wait(), which is imprecise, to sleeping.
_EVENT_NS = 5_000_000

# Linux's PR_SET_TIMERSLACK: how much later the kernel may wake a thread, 50 us by default
_TIMER_SLACK = 29


class PreciseWait:
    """Waits until a deadline on ``time.perf_counter_ns()``, which is precise on every OS.

    Only the thread that creates it may wait; any thread, and a signal handler, may call ``wake``.
    """

    def __init__(self) -> None:
        # This event can be set by a signal handler in the waiting thread.
        self._event = SignalSafeEvent()
        self._spin_ns = 150_000
        if sys.platform.startswith("linux"):
            with contextlib.suppress(OSError, AttributeError, ImportError):
                import ctypes

                if ctypes.CDLL(None).prctl(_TIMER_SLACK, 1, 0, 0, 0) == 0:
                    self._spin_ns = 40_000

    def wake(self) -> None:
        """Interrupt the current wait, or the next one if this wait is in its last 5 ms."""
        self._event.set()

    def until(self, wall: int) -> int:
        """Wait until ``wall`` or until :meth:`wake` is called; return the current time."""
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
                # Busy-poll, releasing the GIL so that other threads can send messages.
                time.sleep(0)
