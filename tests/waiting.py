"""Wait for a condition that no event reports. No other module in the tests polls.

A test that uses a loop with a stopped clock needs ``until`` of :mod:`tests.manual_loop`.
"""

from __future__ import annotations

import asyncio
import inspect
import time
from collections.abc import Awaitable, Callable
from typing import TypeVar

__all__ = ["until", "wait_until"]

_T = TypeVar("_T")

_PATIENCE = 100.0  # seconds; a machine that runs tests may stall
_PAUSE = 0.005  # seconds between two calls of a condition


def wait_until(
    condition: Callable[[], _T],
    seconds: float = _PATIENCE,
    error: str = "the condition does not hold",
    pause: float = _PAUSE,
) -> _T:
    """Return a condition's value once it is true. Raise TimeoutError with the text ``error`` if it is not in time."""
    end = time.monotonic() + seconds
    while not (found := condition()):
        if time.monotonic() > end:
            raise TimeoutError(error)
        time.sleep(pause)
    return found


async def until(
    condition: Callable[[], Awaitable[_T] | _T], seconds: float = _PATIENCE, pause: float = _PAUSE
) -> _T:
    """Let the loop run until a condition, which may be asynchronous, is true; return its value.

    Raise TimeoutError if it is not in time.
    """
    end = time.monotonic() + seconds
    while True:
        found = condition()
        if inspect.isawaitable(found):
            found = await found
        if found:
            return found
        if time.monotonic() > end:
            raise TimeoutError("the condition does not hold")
        await asyncio.sleep(pause)
