"""Work queued until a client's turn: messages that are not encoded yet. Pure."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from minirospy.web.server.account import LARGE_PIECE, Piece, Share

__all__ = ["Jobs"]

_MAX_JOBS = 1000  # maximum number of a client's jobs; each refers to a message not encoded yet
_JOB_BYTES = 500  # memory per job in bytes: 290 (measured), and the record of the job's message

Work = Callable[[], None]


class _Job(NamedTuple):
    work: Work
    message: Piece


class Jobs:
    """A client's queued jobs, oldest first. Limits their number, and the total size of the messages that they refer to.

    A large message counts in the client's share of the server's memory, but only once if it is queued for several clients.
    """

    def __init__(self, max_bytes: int, share: Share) -> None:
        self.size = 0  # memory in bytes used only for this client's jobs
        self._max_bytes = max_bytes
        self._share = share
        self._message_bytes = 0  # total size in bytes of the messages that the jobs refer to
        self._waiting: deque[_Job] = deque()

    def __len__(self) -> int:
        """Return the number of queued jobs."""
        return len(self._waiting)

    def add(self, work: Work, message: Piece) -> int:
        """Append a job that refers to a message; return how many older jobs were dropped."""
        self._waiting.append(_Job(work, message))
        self._count(message, 1)
        self._share.hold((message,))
        dropped = 0
        while len(self) > 1 and (self._message_bytes > self._max_bytes or len(self) > _MAX_JOBS):
            self.pop()
            dropped += 1
        return dropped

    def pop(self) -> Work:
        """Remove and return the oldest job."""
        work, message = self._waiting.popleft()
        self._count(message, -1)
        self._share.release((message,))
        return work

    def clear(self) -> int:
        """Drop all jobs; return their number."""
        dropped = len(self)
        while self._waiting:
            self.pop()
        return dropped

    def _count(self, message: Piece, sign: int) -> None:
        size = len(message)
        self._message_bytes += sign * size
        self.size += sign * (_JOB_BYTES + (size if size < LARGE_PIECE else 0))
