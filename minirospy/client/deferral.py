"""Critical sections in the main thread, during which no signal is dispatched."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator

__all__ = ["Deferral", "is_main_thread"]


class Deferral:
    """A critical section in the main thread. ``with deferral:`` delays the dispatch of signals until the block ends.

    A shutdown hook may publish, log or register, so it must not run while the main thread is in the middle of such an
    operation. Has no effect in other threads, because signals do not interrupt them.
    """

    def __init__(self) -> None:
        # True if the signal handler has recorded a signal that the main thread has not dispatched yet
        self.pending = False
        # Dispatches the pending signal; called in the main thread
        self.dispatch: Callable[[], object] = lambda: None
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
        """Dispatch a pending signal if this is the main thread and it is outside a critical section."""
        if self.pending and not self._depth and is_main_thread():
            self.dispatch()

    @contextlib.contextmanager
    def lifted(self) -> Iterator[None]:
        """Leave the critical section for a block that runs the user's code."""
        depth = int(is_main_thread())
        self._depth -= depth
        try:
            yield
        finally:
            self._depth += depth


def is_main_thread() -> bool:
    """Return whether the calling thread is the main thread. Signals interrupt only that thread."""
    return threading.current_thread() is threading.main_thread()
