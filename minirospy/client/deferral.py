"""Critical sections of the main thread, where no signal is dispatched."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator

__all__ = ["Deferral", "is_main_thread"]


class Deferral:
    """A critical section of the main thread: ``with deferral:`` a signal is dispatched when the block ends.

    A hook may publish, log or register, and so must not run while the main thread is in the middle of one. In
    other threads, where no signal arrives, without effect.
    """

    def __init__(self) -> None:
        self.pending = False
        """Whether a signal waits for the main thread. Set by the signal's handler."""
        self.dispatch: Callable[[], object] = lambda: None
        """Dispatch the pending signal. In the main thread."""
        self._depth = 0

    @property
    def is_active(self) -> bool:
        """Return whether the main thread is inside a critical section."""
        return self._depth > 0

    def __enter__(self) -> None:
        if is_main_thread():
            self._depth += 1

    def __exit__(self, *_: object) -> None:
        if is_main_thread():
            self._depth -= 1
            self.poll()

    def poll(self) -> None:
        """Dispatch a pending signal, where this is the main thread and outside of a critical section."""
        if self.pending and not self._depth and is_main_thread():
            self.dispatch()

    @contextlib.contextmanager
    def lifted(self) -> Iterator[None]:
        """Leave the critical section for the length of a block: for the user's code."""
        depth = int(is_main_thread())
        self._depth -= depth
        try:
            yield
        finally:
            self._depth += depth


def is_main_thread() -> bool:
    """Return whether the calling thread is the one that signals interrupt."""
    return threading.current_thread() is threading.main_thread()
