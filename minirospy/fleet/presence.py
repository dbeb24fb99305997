"""Detects unresponsive gateways: if many robots are lost together, their Zenoh tokens may remain for minutes.

All gateways are queried at regular intervals, and shortly after a robot has left. A gateway that has responded before and
then misses two queries is considered lost until it responds again. A gateway that has never responded, perhaps for lack
of access rights, is never considered lost. Runs on the node's loop.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection

__all__ = ["Presence"]

REGULAR_SECONDS, LOST_SECONDS = 60.0, 10.0
"""Seconds between checks: normally, and while a gateway is lost, to notice its return soon."""
_SETTLE_SECONDS = 2.0
"""Seconds between a robot's departure and the check: robots that are lost together disappear one by one."""
_ROUNDS, ROUND_SECONDS = 2, 5.0


class Presence:
    """Tracks which gateways do not respond."""

    def __init__(
        self,
        query: Callable[[], Awaitable[Collection[str] | None]],
        gateways: Callable[[], Collection[str]],
        changed: Callable[[], object],
    ) -> None:
        """Create the tracker.

        ``query()`` queries all gateways and returns those that responded in time, or None if the query could not be sent.

        ``gateways()`` returns the gateways that have tokens. ``changed()`` is called when a gateway is lost or has
        returned.
        """
        self.lost: frozenset[str] = frozenset()
        self._query = query
        self._gateways = gateways
        self._changed = changed
        self._answered: set[str] = set()
        self._soon = asyncio.Event()

    def answered(self, gateway: str) -> None:
        """Record that a gateway has responded."""
        self._answered.add(gateway)

    def check_soon(self) -> None:
        """Check all gateways soon, because a robot has left."""
        self._soon.set()

    async def watch(self) -> None:
        """Check the gateways at regular intervals, and soon after :meth:`check_soon`."""
        while True:
            pause = LOST_SECONDS if self.lost else REGULAR_SECONDS
            waiting = asyncio.ensure_future(self._soon.wait())
            try:
                await asyncio.wait([waiting], timeout=pause)
            finally:
                waiting.cancel()
            if self._soon.is_set():
                await asyncio.sleep(_SETTLE_SECONDS)
                self._soon.clear()
            await self._check()

    async def _check(self) -> None:
        present = set(self._gateways())
        self._answered &= present
        missing = set(self._answered)
        for number in range(_ROUNDS if present else 0):
            if number:
                await asyncio.sleep(ROUND_SECONDS)
            answers = await self._query()
            if answers is None:
                return
            self._answered |= present.intersection(answers)
            missing.difference_update(answers)
            if missing <= self.lost:
                break
        lost = frozenset(missing)
        if lost != self.lost:
            self.lost = lost
            self._changed()
