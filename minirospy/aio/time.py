"""Simulated time, and rates, for a node in an event loop."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import time
from collections.abc import AsyncIterator, Callable
from typing import TYPE_CHECKING

from minirospy.base.clock import FirstTimeWait
from minirospy.base.errors import ROSInterruptException, ROSTimeMovedBackwardsException

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["Rate", "SimulatedTime"]

_LOOK_SECONDS = 0.1


class Rate:
    """Keeps a loop at ``hz`` iterations per second: ``async for _ in node.rate(hz)``, or ``await rate.sleep()``."""

    def __init__(self, node: Node, hz: float) -> None:
        """Start the first period. Raise ValueError if ``hz`` is not positive."""
        if hz <= 0:
            raise ValueError(f"a rate of {hz} Hz: it has to be above 0")
        self._node = node
        self._period = int(1e9 / hz)
        self._last = node.now().to_nsec()

    def __aiter__(self) -> AsyncIterator[int]:
        return self._turns()

    async def sleep(self) -> None:
        """Sleep for the rest of the period. Raise the same exceptions as :meth:`Node.sleep`."""
        now = self._node.now().to_nsec()
        # Time has jumped back, or the loop body took several periods.
        # Start a new period now, to avoid a very long sleep, or a burst of iterations that makes up for missed periods.
        if not self._last <= now <= self._last + 2 * self._period:
            self._last = now
        self._last += self._period
        await self._node.sleep(max(0, self._last - now) / 1e9)

    async def _turns(self) -> AsyncIterator[int]:
        for turn in itertools.count():
            yield turn
            try:
                await self.sleep()
            except ROSTimeMovedBackwardsException:
                continue
            except ROSInterruptException:
                return


class SimulatedTime:
    """The time in the last /clock message, in nanoseconds; 0 before the first one."""

    def __init__(self, stopping: asyncio.Event, on_silence: Callable[[], object] = lambda: None) -> None:
        """Create the clock. ``on_silence()`` is called once if a sleep has waited two seconds for the first /clock message."""
        self.now = 0
        self._first = FirstTimeWait(on_silence)
        self._stopping = stopping
        self._tick = asyncio.Event()

    def set(self, now: int) -> None:
        self.now = now
        self._tick.set()
        self._tick = asyncio.Event()

    async def sleep(self, nanoseconds: int) -> None:
        """Wait until ``nanoseconds`` have passed, or the node shuts down.

        Raise ROSTimeMovedBackwardsException if time jumps back to before the sleep started.
        """
        started = time.monotonic()
        while self.now == 0 and not self._stopping.is_set():
            await self._next_tick()
            if self.now == 0:
                self._first.check(started)
        start = self.now
        while self.now < start + nanoseconds and not self._stopping.is_set():
            await self._next_tick()
            if self.now < start:
                raise ROSTimeMovedBackwardsException((start - self.now) / 1e9)

    async def _next_tick(self) -> None:
        # A shutdown of the node does not change the time, so wake up periodically to check for one.
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self._tick.wait(), _LOOK_SECONDS)
