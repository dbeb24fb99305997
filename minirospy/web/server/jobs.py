"""Work that waits for a client's turn: messages that are not encoded yet. Pure."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

__all__ = ["Jobs"]

_MAX_JOBS = 1000  # of one client, each of which keeps a message that is not encoded yet

Work = Callable[[], None]


class Jobs:
    """The work of one client, oldest first, bounded in number and in the bytes that it keeps."""

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._size = 0  # bytes that all of the work keeps
        self._waiting: deque[tuple[Work, int]] = deque()

    def __bool__(self) -> bool:
        """Return whether work waits."""
        return bool(self._waiting)

    def add(self, work: Work, size: int) -> int:
        """Append work that keeps ``size`` bytes; return how many older ones were dropped for it."""
        self._waiting.append((work, size))
        self._size += size
        dropped = 0
        while len(self._waiting) > 1 and (self._size > self._max_bytes or len(self._waiting) > _MAX_JOBS):
            self.pop()
            dropped += 1
        return dropped

    def pop(self) -> Work:
        """Remove and return the oldest work."""
        work, size = self._waiting.popleft()
        self._size -= size
        return work

    def clear(self) -> None:
        """Drop all work."""
        self._waiting.clear()
        self._size = 0
