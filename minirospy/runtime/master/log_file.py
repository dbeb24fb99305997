"""A master's log files. Lines are buffered and written twice a second, so that thousands per second cost little."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import sys
import threading
import time
from collections.abc import Callable
from io import TextIOWrapper
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import cast

from minirospy.base import private_files
from minirospy.base.escape import escaped

__all__ = ["LogFile", "LogFileHandler"]

FLUSH_SECONDS = 0.5
# Maximum number of buffered characters; writing megabytes in one call would block the master
_MAX_PENDING = 64 * 1024


class LogFileHandler(RotatingFileHandler):
    """A logging handler that does not follow symbolic links.

    Otherwise another user could predict the log file's name and create a link there.
    """

    def __init__(self, path: Path, max_bytes: int = 0, older_files: int = 0) -> None:
        """Open ``path``. If ``max_bytes`` is 0, there is no size limit. Raise OSError if the file cannot be opened."""
        super().__init__(path, maxBytes=max_bytes, backupCount=older_files, encoding="utf-8")
        self._has_warned = False

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - logging's
        """Warn once, in one line, if the file cannot be written; the base class prints a traceback for each record."""
        error = sys.exc_info()[1]
        if not isinstance(error, OSError):
            super().handleError(record)
        elif logging.raiseExceptions and not self._has_warned and sys.stderr is not None:
            self._has_warned = True
            with contextlib.suppress(OSError, ValueError):
                print(
                    f"WARNING: cannot write the log file [{self.baseFilename}]: {error.strerror}",
                    file=sys.stderr,
                )

    def _open(self) -> TextIOWrapper:
        return cast("TextIOWrapper", private_files.open_text(Path(self.baseFilename), "a"))


class LogFile(LogFileHandler):
    """The log file ``path``, of at most ``max_bytes``, with up to three rotated files.

    Used as a logging handler, it writes warnings and errors immediately. :meth:`line` and :meth:`text` add plain strings
    and must be called on the loop.
    """

    def __init__(self, path: Path, max_bytes: int, name: str) -> None:
        super().__init__(path, max_bytes, older_files=3)
        self.setFormatter(_Formatter(self._stamp))
        self._line_head = f"[{name}][INFO] "
        self._lines: list[str] = []
        self._pending = 0
        self._guard = threading.Lock()
        self._timer: asyncio.TimerHandle | None = None
        self._second = (0, "")

    def line(self, text: str) -> None:
        """Add a line with level INFO. Call this on the loop."""
        self.text(f"{self._line_head}{self._stamp(time.time())}: {escaped(text)}")

    def text(self, text: str) -> None:
        """Add a line that already contains its time and level. Call this on the loop."""
        self._add(text + "\n")
        if self._pending > _MAX_PENDING:
            self._write_out()
        elif self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(FLUSH_SECONDS, self._time_is_up)

    def emit(self, record: logging.LogRecord) -> None:
        """Add a record. Thread-safe."""
        try:
            self._add(self.format(record) + "\n")
        except Exception:  # noqa: BLE001 - like the handlers in the standard library
            self.handleError(record)
        if record.levelno >= logging.WARNING or len(self._lines) > 1000:
            self._write_out()

    def flush(self) -> None:
        """Write the pending lines."""
        self._write_out()

    def close(self) -> None:
        """Write the pending lines and close the file. Idempotent."""
        self._write_out()
        if self._timer:
            self._timer.cancel()
        super().close()

    def _add(self, line: str) -> None:
        with self._guard:
            self._lines.append(line)
            self._pending += len(line)

    def _stamp(self, now: float) -> str:
        second, stamp = self._second
        if int(now) != second:
            second, stamp = int(now), time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(now))
            self._second = (second, stamp)
        return f"{stamp},{int((now - second) * 1000):03d}"

    def _time_is_up(self) -> None:
        self._timer = None
        self._write_out()

    def _write_out(self) -> None:
        with self._guard:
            lines, self._lines, self._pending = self._lines, [], 0
            if not lines:
                return

            try:
                if self.stream is None:
                    self.stream = self._open()
                if self.stream.tell() > self.maxBytes and os.path.isfile(self.baseFilename):
                    self.doRollover()
                self.stream.write("".join(lines))
                self.stream.flush()
            except (OSError, ValueError):
                # A full disk must not stop the master.
                # Discard the stream; closing it normally would fail again because of its unwritten data.
                if self.stream:
                    with contextlib.suppress(OSError, ValueError):
                        self.stream.close()
                    self.stream = None


class _Formatter(logging.Formatter):
    """Formats records like the file's other lines. Caches the formatted time of the current second."""

    def __init__(self, stamp: Callable[[float], str]) -> None:
        super().__init__("[%(name)s][%(levelname)s] %(asctime)s: %(message)s")
        self._stamp = stamp

    def formatTime(self, record: logging.LogRecord, datefmt: str | None = None) -> str:  # noqa: N802 - logging's
        return self._stamp(record.created)

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - logging's
        # Escape the names and URIs in the message: peers choose them, and must not be able to start another line.
        record.message = escaped(record.message)
        return super().formatMessage(record)
