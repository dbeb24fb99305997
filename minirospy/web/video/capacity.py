"""A limit on the total size of concurrent work. Work that exceeds the limit waits in order."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

__all__ = ["Capacity"]


class Capacity:
    """Limits concurrent work to ``units``. Runs on the loop."""

    def __init__(self, units: int) -> None:
        self.units = units
        self.taken_units = 0  # units in use by running work
        self._waiting: deque[tuple[int, asyncio.Future[None]]] = deque()

    @asynccontextmanager
    async def taken(self, units: int) -> AsyncIterator[None]:
        """Acquire ``units`` for the duration of the context. Work that exceeds the limit runs alone."""
        units = min(units, self.units)
        if self._waiting or self.taken_units + units > self.units:
            turn = asyncio.get_running_loop().create_future()
            self._waiting.append((units, turn))
            try:
                await turn
            except asyncio.CancelledError:
                if not turn.cancelled():
                    self.taken_units -= units  # the units were granted just before the cancellation
                self._admit()
                raise
        else:
            self.taken_units += units
        try:
            yield
        finally:
            self._give_back(units)

    def _give_back(self, units: int) -> None:
        self.taken_units -= units
        self._admit()

    def _admit(self) -> None:
        while self._waiting:
            units, turn = self._waiting[0]
            if not turn.cancelled():
                if self.taken_units + units > self.units:
                    return
                self.taken_units += units
                turn.set_result(None)
            self._waiting.popleft()
