"""A thread that stops actuators when their commands stop arriving, even if the event loop is blocked.

A call that holds Python's global interpreter lock (GIL) does delay the thread, so the servers limit the input of one call.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from minirospy.base.errors import BridgeError

__all__ = ["StopGuard"]

_log = logging.getLogger(__name__)

Stop = Callable[[], None]
"""A function that stops an actuator. It runs in the guard's thread, and must check whether a command has arrived in the
meantime.
"""


class StopGuard:
    """Calls each function when its deadline passes. A thread runs as long as there are deadlines; all methods are thread-safe."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Create the guard; ``clock`` returns seconds."""
        self._clock = clock
        self._lock = threading.RLock()
        self._changed = threading.Condition(self._lock)
        self.deadlines: dict[Stop, float] = {}
        self.thread: threading.Thread | None = None
        self._next = 0.0
        # The deadline for which the thread is waiting.

    def arm(self, stop: Stop, deadline: float) -> None:
        """Call ``stop`` at ``deadline``, in seconds of the clock. This replaces the previous deadline of ``stop``.

        Raise BridgeError if the thread cannot be started.
        """
        with self._lock:
            self.deadlines[stop] = deadline
            if self.thread is None:
                self.thread = threading.Thread(target=self._run, name="stop-guard", daemon=True)
                try:
                    self.thread.start()
                except RuntimeError as error:
                    self.thread = None
                    del self.deadlines[stop]
                    raise BridgeError(
                        f"nothing is driven: no thread can be started to stop it: {error}"
                    ) from error
            elif deadline < self._next:
                self._changed.notify()

    def disarm(self, stop: Stop) -> None:
        """Remove the deadline of ``stop``. Idempotent."""
        with self._lock:
            self.deadlines.pop(stop, None)

    def _run(self) -> None:
        while due := self._wait():
            for stop in due:
                try:
                    stop()
                except Exception:  # noqa: BLE001 - one function's error must not prevent the other calls
                    _log.exception("what is driven could not be stopped")

    def _wait(self) -> list[Stop]:
        """Wait until a deadline passes; remove and return the functions that are due. Return [] if there are no deadlines."""
        with self._lock:
            while self.deadlines:
                now = self._clock()
                due = [stop for stop, deadline in self.deadlines.items() if deadline <= now]
                if due:
                    for stop in due:
                        del self.deadlines[stop]
                    return due
                self._next = min(self.deadlines.values())
                self._changed.wait(self._next - now)
            self.thread = None
            return []
