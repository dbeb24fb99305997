"""Whether a shutdown hook runs in the middle of another call: a signal has interrupted that, and it ends after the hook."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar

__all__ = ["dispatching_signal", "is_dispatching_signal"]

_is_dispatching = ContextVar("_is_dispatching", default=False)


@contextlib.contextmanager
def dispatching_signal() -> Iterator[None]:
    """While a block runs, :func:`is_dispatching_signal` is true in this thread: it handles a signal."""
    token = _is_dispatching.set(True)
    try:
        yield
    finally:
        _is_dispatching.reset(token)


def is_dispatching_signal() -> bool:
    """Return whether this thread handles a signal, in the middle of whatever else it does."""
    return _is_dispatching.get()
