"""Run long work on the event loop, a few milliseconds per iteration, so that it does not delay other work."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import deque
from collections.abc import Callable

from minirospy.base.steps import ALONE, PAUSE, Steps

__all__ = ["Turns"]

_log = logging.getLogger(__name__)

_SECONDS = 0.003  # time limit in seconds per loop iteration for all work together

_PAUSE = 0.005  # seconds to pause if all remaining work is blocked

# maximum number of generators in progress; those not started yet take hardly any memory
_MAX_IN_PROGRESS = 16


class Turns:
    """Runs a limited number of generators concurrently on one event loop, with equal shares of time."""

    def __init__(self, seconds: float = _SECONDS, clock: Callable[[], float] = time.perf_counter) -> None:
        self._seconds = seconds
        self._clock = clock
        self._queue: deque[Steps[None]] = deque()
        self._backlog: deque[Steps[None]] = deque()
        # The generator that runs alone because it uses much memory, and those waiting to run alone.
        self._alone: Steps[None] | None = None
        self._waiting: deque[Steps[None]] = deque()
        self._running: Steps[None] | None = None
        self._is_scheduled = False

    def __len__(self) -> int:
        return len(self._queue) + len(self._waiting) + len(self._backlog)

    def start(self, steps: Steps[None]) -> None:
        """Run ``steps``, starting in the next loop iteration."""
        (self._queue if len(self._queue) < _MAX_IN_PROGRESS else self._backlog).append(steps)
        self._schedule()

    def cancel(self, steps: Steps[None]) -> None:
        """Cancel the work ``steps``. Idempotent."""
        for queue in (self._queue, self._waiting, self._backlog):
            if steps in queue:
                queue.remove(steps)
        self._release(steps)
        # A generator that cancels itself is executing its last step and cannot be closed.
        if steps is not self._running:
            steps.close()

    def close(self) -> None:
        """Cancel all work. Idempotent."""
        for steps in [*self._queue, *self._waiting, *self._backlog]:
            self.cancel(steps)

    def _schedule(self) -> None:
        while self._backlog and len(self._queue) < _MAX_IN_PROGRESS:
            self._queue.append(self._backlog.popleft())
        if self._queue and not self._is_scheduled:
            self._is_scheduled = True
            asyncio.get_running_loop().call_soon(self._turn)

    def _turn(self) -> None:
        self._is_scheduled = False
        end = self._clock() + self._seconds
        pausing: list[Steps[None]] = []
        while self._queue:
            steps = self._queue.popleft()
            if self._run(steps, end):
                (self._queue if self._is_over(end) else pausing).append(steps)
            if self._is_over(end):
                break
        is_idle = not self._queue
        self._queue.extend(pausing)
        if pausing and is_idle:
            self._is_scheduled = True
            asyncio.get_running_loop().call_later(_PAUSE, self._turn)
        else:
            self._schedule()

    def _is_over(self, end: float) -> bool:
        return self._clock() >= end

    def _run(self, steps: Steps[None], end: float) -> bool:
        """Run ``steps`` until the time ``end``; return whether work remains."""
        self._running = steps
        try:
            while True:
                need = next(steps)
                if need is ALONE and not self._claim(steps):
                    return False
                if need is PAUSE or self._is_over(end):
                    return True
        except StopIteration:
            pass
        except Exception:  # noqa: BLE001 - one generator's error must not end the others
            _log.exception("fault in a long piece of work")
        finally:
            self._running = None
        self._release(steps)
        return False

    def _claim(self, steps: Steps[None]) -> bool:
        """Return whether ``steps`` may run alone now; if not, queue them."""
        if self._alone is None:
            self._alone = steps
        if self._alone is steps:
            return True
        self._waiting.append(steps)
        return False

    def _release(self, steps: Steps[None]) -> None:
        if self._alone is steps:
            self._alone = self._waiting.popleft() if self._waiting else None
            if self._alone:
                self._queue.append(self._alone)
                self._schedule()
