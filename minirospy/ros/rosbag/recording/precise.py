"""Waiting until a point in time, to some microseconds, and ending the wait early."""

from __future__ import annotations

import contextlib
import sys
import time

from minirospy.base.clock import SignalSafeEvent

__all__ = ["PreciseWait"]

_EVENT_NS = 5_000_000
"""Longer waits are waits for the event, which are less precise; the last of these nanoseconds are slept."""

_TIMER_SLACK = 29
"""PR_SET_TIMERSLACK of Linux's prctl: how late the kernel may wake a thread. 50 us unless it is set."""


class PreciseWait:
    """Waits on ``time.perf_counter_ns()``, which is precise on every OS.

    For one thread, which makes it; any other, and a signal's handler, may call ``wake``.
    """

    def __init__(self) -> None:
        # A signal's handler wakes the thread that it interrupts.
        self._event = SignalSafeEvent()
        self._spin_ns = 150_000
        if sys.platform.startswith("linux"):
            with contextlib.suppress(OSError, AttributeError, ImportError):
                import ctypes

                if ctypes.CDLL(None).prctl(_TIMER_SLACK, 1, 0, 0, 0) == 0:
                    self._spin_ns = 40_000

    def wake(self) -> None:
        """End the current wait, or the next one, if it is a long one."""
        self._event.set()

    def until(self, wall: int) -> int:
        """Wait until ``wall``, or until :meth:`wake` is called; return the time."""
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
                # Busy-poll, but let the threads that send have the GIL.
                time.sleep(0)
