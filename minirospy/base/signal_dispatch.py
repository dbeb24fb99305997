"""The signals that Ctrl-C sends, and a flag for shutdown hooks that run inside a call interrupted by a signal."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator

__all__ = ["dispatching_signal", "interrupt_signals", "is_dispatching_signal"]

_this_thread = threading.local()


@contextlib.contextmanager
def dispatching_signal() -> Iterator[None]:
    """Make :func:`is_dispatching_signal` return True in this thread during the block. The block handles a signal."""
    _this_thread.is_dispatching = True
    try:
        yield
    finally:
        _this_thread.is_dispatching = False


def is_dispatching_signal() -> bool:
    """Return whether this thread is running a signal handler that interrupted another call."""
    return getattr(_this_thread, "is_dispatching", False)


def interrupt_signals() -> list[signal.Signals]:
    """Return the signals that interrupt a program: SIGINT (Ctrl-C) and, on Windows, SIGBREAK (Ctrl-Break).

    On Windows, only SIGBREAK reaches a process in a separate process group.
    """
    found = (getattr(signal, name, None) for name in ("SIGINT", "SIGBREAK"))
    return [number for number in found if number is not None]
