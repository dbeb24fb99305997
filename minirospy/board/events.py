"""Edge detection: calls the callbacks for reported edges, one at a time, in a single thread.

Debouncing is RPi.GPIO's: the first edge is reported, then the pin is ignored for the bounce time.
"""

from __future__ import annotations

import queue
import sys
import threading
import traceback
from collections.abc import Callable
from enum import IntEnum

from minirospy.base.clock import SignalSafeEvent

__all__ = ["Callback", "CallbackThread", "Detector", "Slope"]

Callback = Callable[[int], object]


class Slope(IntEnum):
    """The direction of the edges to detect; the numbers are RPi.GPIO's."""

    RISING = 31
    FALLING = 32
    BOTH = 33


class Detector:
    """Watches one channel: decides which edges to report, and records whether one has occurred.

    ``bouncetime`` is in seconds, or None for no debouncing.
    """

    def __init__(self, channel: int, slope: Slope, bouncetime: float | None) -> None:
        self.channel = channel
        self.slope = slope
        self.callbacks: list[Callback] = []
        self.active = True
        self._bouncetime = bouncetime
        self._last: float | None = None
        self._occurred = SignalSafeEvent()

    def see(self, level: int, now: float) -> bool:
        """Return whether to report an edge to ``level`` at ``now`` (seconds on a monotonic clock); if so, record the edge."""
        if self.slope is not Slope.BOTH and (self.slope is Slope.RISING) != bool(level):
            return False
        if self._bouncetime is not None and self._last is not None and now - self._last <= self._bouncetime:
            return False
        self._last = now
        self._occurred.set()
        return True

    def excludes(self, waiter: Detector) -> bool:
        """Return whether waiting with the detector ``waiter`` would conflict with this detector on the same channel."""
        same = waiter.slope is self.slope
        return bool(self.callbacks) or (same and self._bouncetime not in (None, waiter._bouncetime))

    def take(self) -> bool:
        """Return whether an edge has been recorded since the last call."""
        occurred = self._occurred.is_set()
        self._occurred.clear()
        return occurred

    def wait(self, timeout: float | None) -> bool:
        """Wait up to ``timeout`` seconds until :meth:`see` has recorded an edge; return whether it has."""
        if timeout is not None or sys.platform != "win32":
            return self._occurred.wait(timeout)
        # Wait in slices: Windows delivers Ctrl-C only between waits.
        while not self._occurred.wait(0.2):
            pass
        return True


class CallbackThread:
    """Runs callbacks in the order of their edges. If a callback raises, prints the exception and runs the next callback."""

    def __init__(self) -> None:
        self._due: queue.SimpleQueue[Detector | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="gpio-callbacks", daemon=True)
        self._thread.start()

    def schedule(self, detector: Detector) -> None:
        """Queue a run of all callbacks of ``detector``. If it is removed, the callbacks that have not started are skipped."""
        self._due.put(detector)

    def close(self) -> None:
        """Stop the thread after the callback in progress."""
        self._due.put(None)
        if threading.current_thread() is not self._thread:
            self._thread.join(1.0)

    def _run(self) -> None:
        while (detector := self._due.get()) is not None:
            for callback in list(detector.callbacks):
                if not detector.active:
                    break
                try:
                    callback(detector.channel)
                except Exception:  # noqa: BLE001 - the user's code; RPi.GPIO prints and goes on, too
                    traceback.print_exc()
