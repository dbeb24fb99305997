"""Wait for a condition that no event reports. No other module in the tests polls.

A test that uses a loop with a stopped clock needs ``until`` of :mod:`tests.manual_loop`.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

__all__ = ["until", "wait_until"]

_PATIENCE = 100.0  # seconds; a machine that runs tests may stall
_PAUSE = 0.005  # seconds between two calls of a condition


def wait_until(
    condition: Callable[[], object], seconds: float = _PATIENCE, error: str = "the condition does not hold"
) -> None:
    """Return once a condition is true. Raise TimeoutError with the message ``error`` if that takes too long."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(error)
        time.sleep(_PAUSE)


async def until(condition: Callable[[], object], seconds: float = _PATIENCE) -> None:
    """Let the loop run until a condition is true. Raise TimeoutError if that takes too long."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("the condition does not hold")
        await asyncio.sleep(_PAUSE)
