"""Log lines about one thing that may go wrong a thousand times a second."""

from __future__ import annotations

import logging
import time

from minirospy.escape import escaped

__all__ = ["Complaints"]

_SECONDS = 10.0


class Complaints:
    """Logs the first ``lines`` of a flood, and so many every ten seconds, with the number of those left out."""

    def __init__(self, log: logging.Logger, lines: int = 1) -> None:
        self._log = log
        self._most = lines
        self._told = 0
        self._held = 0
        # The ten seconds that run.
        self._end = 0.0

    def close(self) -> None:
        """Tell how many were left out last. Idempotent."""
        if self._held:
            self._log.warning("%d more like the last ones", self._held)
            self._held = 0

    def error(self, text: str, *args: object) -> None:
        """Log an error, or count it."""
        self._tell(logging.ERROR, text, args)

    def warning(self, text: str, *args: object) -> None:
        """Log a warning, or count it."""
        self._tell(logging.WARNING, text, args)

    def _tell(self, level: int, text: str, args: tuple[object, ...]) -> None:
        now = time.monotonic()
        if now >= self._end:
            if self._held:
                text, args = text + " (and %d more like it before)", (*args, self._held)
            self._end, self._told, self._held = now + _SECONDS, 0, 0
        elif self._told == self._most:
            self._held += 1
            return
        self._told += 1
        # Names and errors of peers: what is not text is ours.
        shown = [escaped(str(arg)) if isinstance(arg, str | Exception) else arg for arg in args]
        self._log.log(level, text, *shown, stacklevel=3)
