"""A logger for messages that may repeat a thousand times a second."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING

from minirospy.base.escape import escaped

if TYPE_CHECKING:
    import asyncio

__all__ = ["RateLimitedLogger"]

INTERVAL_SECONDS = 10.0


class RateLimitedLogger:
    """Logs at most ``lines`` lines every ten seconds, and counts the rest."""

    def __init__(self, log: logging.Logger, lines: int = 1) -> None:
        self._log = log
        self._limit = lines
        self._logged = 0
        self._omitted = 0
        self._end = 0.0  # time at which the current ten-second window ends

    def close(self) -> None:
        """Log the number of lines omitted since the last report. Idempotent."""
        if self._omitted:
            self._log.warning("%d more like the last ones", self._omitted)
            self._omitted = 0

    def info(self, text: str, *args: object) -> None:
        """Log an info message, or count it."""
        self._write(logging.INFO, text, args)

    def close_later(self, loop: asyncio.AbstractEventLoop) -> None:
        """If exactly one line has been omitted so far, schedule :meth:`close` for the end of the current ten-second window."""
        if self._omitted == 1:
            loop.call_later(max(0.0, self._end - time.monotonic()), self.close)

    def critical(self, text: str, *args: object) -> None:
        """Log a fatal error, or count it."""
        self._write(logging.CRITICAL, text, args)

    def error(self, text: str, *args: object) -> None:
        """Log an error, or count it."""
        self._write(logging.ERROR, text, args)

    def warning(self, text: str, *args: object) -> None:
        """Log a warning, or count it."""
        self._write(logging.WARNING, text, args)

    def _write(self, level: int, text: str, args: tuple[object, ...]) -> None:
        now = time.monotonic()
        if now >= self._end:
            if self._omitted:
                text, args = text + " (and %d more like it before)", (*args, self._omitted)
            self._end, self._logged, self._omitted = now + INTERVAL_SECONDS, 0, 0
        elif self._logged == self._limit:
            self._omitted += 1
            return

        self._logged += 1
        # Strings and errors may contain text from peers; other arguments cannot.
        shown = [escaped(str(arg)) if isinstance(arg, str | Exception) else arg for arg in args]
        self._log.log(level, text, *shown, stacklevel=3)
