"""Waiting for a condition that no event reports: the one place where tests poll, and the one limit.

A test whose loop's clock stands still has ``until`` of :mod:`tests.manual_loop`.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

__all__ = ["until", "wait_until"]

_PATIENCE = 100.0
"""Seconds: a machine that runs tests may stand still for some."""
_PAUSE = 0.005


def wait_until(condition: Callable[[], object]) -> None:
    """Return once a condition holds. Raise TimeoutError if it never does."""
    end = time.monotonic() + _PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("the condition does not hold")
        time.sleep(_PAUSE)


async def until(condition: Callable[[], object]) -> None:
    """Let the loop run until a condition holds. Raise TimeoutError if it never does."""
    end = time.monotonic() + _PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("the condition does not hold")
        await asyncio.sleep(_PAUSE)
