"""Time limits of many things that are nearly always done in time: one timer of the loop serves them all."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

__all__ = ["Deadlines"]

_T = TypeVar("_T")


class Deadlines(Generic[_T]):
    """Until when each has to be done; ``late`` is called with one that is not (on the loop)."""

    def __init__(self, late: Callable[[_T], object]) -> None:
        self._late = late
        self._ends: dict[_T, float] = {}
        self._timer: asyncio.TimerHandle | None = None
        # When the timer goes off: no later than the first of the ends.
        self._next = 0.0

    def __len__(self) -> int:
        return len(self._ends)

    def __iter__(self) -> Iterator[_T]:
        return iter(self._ends)

    def set(self, each: _T, seconds: float) -> None:
        """It has so long from now on."""
        loop = asyncio.get_running_loop()
        end = self._ends[each] = loop.time() + seconds
        if self._timer is None or end < self._next:
            self._watch(loop, end)

    def drop(self, each: _T) -> None:
        """It is done. Idempotent."""
        self._ends.pop(each, None)

    def close(self) -> None:
        """Nothing is late any more. Idempotent."""
        self._ends.clear()
        self._stop_timer()

    def _stop_timer(self) -> None:
        if self._timer:
            self._timer.cancel()
            self._timer = None

    def _watch(self, loop: asyncio.AbstractEventLoop, end: float) -> None:
        self._stop_timer()
        self._next = end
        self._timer = loop.call_at(end, self._end_late)

    def _end_late(self) -> None:
        self._timer = None
        loop = asyncio.get_running_loop()
        now = loop.time()
        for each in [each for each, end in self._ends.items() if end <= now]:
            self.drop(each)
            self._late(each)
        if self._ends:
            self._watch(loop, min(self._ends.values()))
