"""Close several objects, even if closing one fails."""

from __future__ import annotations

import inspect
import logging
from collections.abc import Awaitable, Callable, Iterable

__all__ = ["close_all", "close_each"]

_log = logging.getLogger(__name__)

CloseFunction = Callable[[], object]
AsyncCloseFunction = Callable[[], Awaitable[object] | object]


def close_each(functions: Iterable[CloseFunction]) -> None:
    """Call each function in order; log an exception and continue with the next function."""
    for function in functions:
        try:
            function()
        except Exception:  # noqa: BLE001 - whatever fails, the rest must be closed
            _log.exception("closing failed; what remains is closed all the same")


async def close_all(functions: Iterable[AsyncCloseFunction]) -> None:
    """Like :func:`close_each`, but also await the results of coroutine functions.

    If the calling task is cancelled, the remaining functions are not called.
    """
    for function in functions:
        try:
            closing = function()
            if inspect.isawaitable(closing):
                await closing
        except Exception:  # noqa: BLE001 - whatever fails, the rest must be closed
            _log.exception("closing failed; what remains is closed all the same")
