"""Time limits for many operations, nearly all of which complete in time. Uses a single loop timer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

__all__ = ["Deadlines"]

_T = TypeVar("_T")


class Deadlines(Generic[_T]):
    """The deadline of each operation in progress.

    ``late`` is called on the loop with each overdue operation, in the order of their deadlines.
    """

    def __init__(self, late: Callable[[_T], object]) -> None:
        self._late = late
        self._ends: dict[_T, float] = {}
        self._timer: asyncio.TimerHandle | None = None
        # The time at which the timer fires, no later than the earliest deadline.
        self._next = 0.0

    def __len__(self) -> int:
        return len(self._ends)

    def __iter__(self) -> Iterator[_T]:
        return iter(self._ends)

    def set(self, each: _T, seconds: float) -> None:
        """Set the deadline of ``each`` to ``seconds`` from now, replacing its previous one."""
        loop = asyncio.get_running_loop()
        end = self._ends[each] = loop.time() + seconds
        if self._timer is None or end < self._next:
            self._watch(loop, end)

    def drop(self, each: _T) -> None:
        """Remove the deadline of a completed operation. Idempotent."""
        self._ends.pop(each, None)

    def close(self) -> None:
        """Remove all deadlines. Idempotent."""
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

        # After a stall, several deadlines may have passed: process them in order of time, not of the set() calls.
        late = sorted(
            (end, number, each) for number, (each, end) in enumerate(self._ends.items()) if end <= now
        )
        for end, _, each in late:
            # The call for an earlier operation may have completed this operation or extended its deadline.
            if self._ends.get(each) == end:
                self.drop(each)
                self._late(each)

        if self._ends:
            self._watch(loop, min(self._ends.values()))
