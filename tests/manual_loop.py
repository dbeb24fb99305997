"""An event loop whose clock the test holds: a time limit passes when the test says so, on any machine."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

__all__ = ["ManualLoop", "run_manually"]


class ManualLoop(asyncio.SelectorEventLoop):
    """Sockets work as usual; timers fire only when :meth:`advance` has moved the clock past them."""

    def __init__(self) -> None:
        super().__init__()
        self._now = 1000.0

    def time(self) -> float:
        """Return the loop's clock, in seconds."""
        return self._now

    async def advance(self, seconds: float) -> None:
        """Move the clock in one leap, as a stall of the machine does, and run what is due then."""
        self._now += seconds
        # The first turn collects the timers that are due, the next ones run what their callbacks start.
        for _ in range(4):
            await asyncio.sleep(0)


def run_manually(scene: Callable[[ManualLoop], Coroutine[Any, Any, None]]) -> None:
    """Run a scene on a loop of its own, whose clock stands still until the scene advances it."""
    loop = ManualLoop()
    try:
        loop.run_until_complete(scene(loop))
    finally:
        loop.run_until_complete(loop.shutdown_asyncgens())
        loop.close()
