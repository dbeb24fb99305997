"""Work that waits for a client's turn: messages that are not encoded yet. Pure."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from minirospy.web.server.account import LARGE_PIECE, Piece, Share

__all__ = ["Jobs"]

_MAX_JOBS = 1000  # of one client, each of which keeps a message that is not encoded yet
_JOB_BYTES = 500  # of memory for a job: 290 were measured, and its message's record

Work = Callable[[], None]


class _Job(NamedTuple):
    work: Work
    message: Piece


class Jobs:
    """The work of one client, oldest first, bounded in number and in the bytes of the messages that it keeps.

    Large messages are counted in the client's share of the server's memory, once for all clients for which they wait.
    """

    def __init__(self, max_bytes: int, share: Share) -> None:
        self.size = 0  # bytes of memory that the work takes for this client alone
        self._max_bytes = max_bytes
        self._share = share
        self._message_bytes = 0  # of all messages that are kept
        self._waiting: deque[_Job] = deque()

    def __len__(self) -> int:
        """Return the number of jobs that wait."""
        return len(self._waiting)

    def add(self, work: Work, message: Piece) -> int:
        """Append work that keeps a message; return how many older jobs were dropped for it."""
        self._waiting.append(_Job(work, message))
        self._count(message, 1)
        self._share.hold((message,))
        dropped = 0
        while len(self) > 1 and (self._message_bytes > self._max_bytes or len(self) > _MAX_JOBS):
            self.pop()
            dropped += 1
        return dropped

    def pop(self) -> Work:
        """Remove and return the oldest work."""
        work, message = self._waiting.popleft()
        self._count(message, -1)
        self._share.release((message,))
        return work

    def clear(self) -> int:
        """Drop all work; return the number of jobs."""
        dropped = len(self)
        while self._waiting:
            self.pop()
        return dropped

    def _count(self, message: Piece, sign: int) -> None:
        size = len(message)
        self._message_bytes += sign * size
        self.size += sign * (_JOB_BYTES + (size if size < LARGE_PIECE else 0))
