"""An event loop whose clock the test controls: timeouts expire when the test decides, on any machine."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from typing import Any

__all__ = ["ManualLoop", "run_manually", "until"]

_PATIENCE = 60.0  # seconds of wall time after which a condition counts as never becoming true


class ManualLoop(asyncio.SelectorEventLoop):
    """Sockets work as usual; timers fire only when :meth:`advance` has moved the clock past them."""

    def __init__(self) -> None:
        super().__init__()
        self._now = 1000.0

    def time(self) -> float:
        """Return the loop's clock, in seconds."""
        return self._now

    async def advance(self, seconds: float) -> None:
        """Advance the clock in one step, as if the machine had stalled, and run everything that is due then."""
        # Let new tasks set their timers by the current clock.
        await self._settle()
        self._now += seconds
        await self._settle()

    @staticmethod
    async def _settle() -> None:
        # The first iteration collects the timers that are due, the next ones run the tasks that their callbacks
        # start.
        for _ in range(20):
            await asyncio.sleep(0)


def run_manually(scene: Callable[[ManualLoop], Coroutine[Any, Any, None]]) -> None:
    """Run a scene on a new loop, whose clock only the scene advances."""
    loop = ManualLoop()
    try:
        loop.run_until_complete(scene(loop))
    finally:
        loop.run_until_complete(loop.shutdown_asyncgens())
        loop.close()


async def until(condition: Callable[[], object]) -> None:
    """Let sockets and threads run until the condition is true. Meanwhile, the loop's clock does not advance."""
    end = time.monotonic() + _PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("the condition does not hold")
        await asyncio.sleep(0)
