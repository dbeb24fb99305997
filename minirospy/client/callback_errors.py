"""Log the errors that the program's callbacks raise.

Each error is logged in full the first time, and then in one line with the number of repetitions.
"""

from __future__ import annotations

import logging
import sys
import threading
import time
import traceback
from collections.abc import Callable
from types import TracebackType

__all__ = ["CallbackErrors"]

_SECONDS = 10.0  # minimum seconds between log lines about the same error

_log = logging.getLogger("rosout")


class _Repeated:
    """An error that has been logged in full. Later occurrences are counted, and logged on one line at intervals."""

    __slots__ = ("due", "line", "omitted")

    def __init__(self, due: float, line: str) -> None:
        self.due = due  # time when the next line may be logged
        self.line = line  # one-line description of the last occurrence
        self.omitted = 0  # number of occurrences since the last line that was logged


class CallbackErrors:
    """Logs the errors that a node's callbacks raise.

    Two errors are the same if they have the same type and callback, and were raised at the same line of code.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Create a log without errors. ``clock()`` returns the time in seconds."""
        self._clock = clock
        # Keyed by the error's type, the callback's name, the file and the line.
        # The table stays small, because a program raises errors in few places.
        self._known: dict[tuple[type[BaseException], str, str, int], _Repeated] = {}
        # Use a reentrant lock: a signal handler that interrupts :meth:`log` may call :meth:`close` in the same thread.
        self._lock = threading.RLock()

    def log(self, callback: object, error: BaseException, advice: str = "") -> None:
        """Log an error that ``callback`` raised, or only count it if the same error was logged recently.

        ``advice`` is printed once, outside the log: programs compare the log's text with ROS's.
        """
        now = self._clock()
        name = getattr(callback, "__qualname__", type(callback).__qualname__)
        place = type(error), name, *_place(error.__traceback__)
        shown = _shown(callback)
        line = f"bad callback: {shown}: {type(error).__name__}: {' '.join(_shown(error).split())}"
        with self._lock:
            known = self._known.get(place)
            if known is None:
                self._known[place] = _Repeated(now + _SECONDS, line)
            else:
                known.omitted += 1
                known.line = line
                if now < known.due:
                    return
                known.due = now + _SECONDS
                line, known.omitted = _counted(known), 0

        if known is None:
            text = "".join(traceback.format_exception(error))
            _log.error("bad callback: %s\n%s", shown, text, stacklevel=2)
            if advice and sys.stderr is not None:
                print(f"minirospy: {advice}", file=sys.stderr)
        else:
            _log.error("%s", line, stacklevel=2)

    def close(self) -> None:
        """Log the number of errors that were counted since the last line. Idempotent."""
        with self._lock:
            lines = [_counted(known) for known in self._known.values() if known.omitted]
            for known in self._known.values():
                known.omitted = 0
        for line in lines:
            _log.error("%s", line)


def _shown(value: object) -> str:
    """Return str() of a program's object, or a replacement if that fails."""
    try:
        return str(value)
    except Exception:  # noqa: BLE001 - any exception that the program's __str__ or __repr__ raises
        return f"<{type(value).__qualname__} whose str() fails>"


def _counted(known: _Repeated) -> str:
    return f"{known.line} ({known.omitted} more times; the first one is logged above)"


def _place(trace: TracebackType | None) -> tuple[str, int]:
    """Return the file and the line at which an error was raised."""
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return (trace.tb_frame.f_code.co_filename, trace.tb_lineno) if trace else ("", 0)
