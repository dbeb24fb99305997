"""Long-running tasks that survive unexpected errors: each error is reported in one line, and the task continues.

asyncio reports a task's exception only when the task is garbage-collected, which never happens while its owner refers to it.
"""

from __future__ import annotations

import asyncio
import logging
import traceback
from collections.abc import Awaitable, Callable
from pathlib import Path

from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

__all__ = ["ErrorReporter", "keep_running"]

PAUSE_SECONDS = 1.0
_MAX_CHARACTERS = 500


class ErrorReporter:
    """Reports unexpected errors in a long-running task: one line per ten seconds, with the number of suppressed errors."""

    def __init__(self, log: logging.Logger, work: str) -> None:
        """Create a reporter. ``work`` is the task's description in log lines, such as "the watch of the graph"."""
        self._log = log
        self._lines = RateLimitedLogger(log)
        self._work = work

    def report(self, error: BaseException) -> None:
        """Log the error and its location; the traceback is logged at level debug."""
        last = traceback.extract_tb(error.__traceback__)[-1:]
        where = "".join(f" at {Path(frame.filename).name}:{frame.lineno}" for frame in last)
        text = " ".join(traceback.format_exception_only(type(error), error)[-1].split())
        self._lines.error("%s failed%s: %s", self._work, where, text[:_MAX_CHARACTERS])
        self._log.debug("%s failed", self._work, exc_info=error)

    def of_task(self, task: asyncio.Future[None]) -> None:
        """Report a task's exception; pass this method to ``add_done_callback``."""
        if not task.cancelled() and (error := task.exception()):
            self.report(error)


async def keep_running(
    work: Callable[[], Awaitable[object]], reporter: ErrorReporter, *, pause: float = PAUSE_SECONDS
) -> None:
    """Run ``work`` until it returns or is cancelled. If it raises, report the error and restart it after ``pause`` seconds."""
    while True:
        try:
            await work()
        except Exception as error:  # noqa: BLE001 - nothing else would report a task's exception
            reporter.report(error)
        else:
            return
        await asyncio.sleep(pause)
