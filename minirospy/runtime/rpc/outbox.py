"""The bytes of answers that wait for a client to read them."""

from __future__ import annotations

import socket
from collections import deque
from collections.abc import Sequence

__all__ = ["MAX_UNREAD", "Outbox"]

MAX_UNREAD = 256 * 1024
"""Bytes of answers that wait for a client to read them, before it gets no more."""


class Outbox:
    """A queue of bytes in front of a socket that does not block. True if something waits in it."""

    __slots__ = ("_pieces", "_sock", "size")

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self._pieces: deque[memoryview] = deque()
        self.size = 0
        """Bytes that wait."""

    def __bool__(self) -> bool:
        """Return whether something waits."""
        return self.size > 0

    def write(self, pieces: Sequence[bytes]) -> int:
        """Send what the socket takes, and keep the rest; return how many bytes that is. Raise OSError."""
        sent = 0
        if not self.size:
            try:
                sent = self._sock.send(pieces[0])
            except (BlockingIOError, InterruptedError):
                pass
            if len(pieces) == 1 and sent == len(pieces[0]):
                return 0

        left = sent
        for piece in pieces:
            if left < len(piece):
                self._pieces.append(memoryview(piece)[left:])
            left = max(0, left - len(piece))

        kept = sum(map(len, pieces)) - sent
        self.size += kept
        return kept

    def flush(self) -> int:
        """Send what the socket takes of the queue; return how many bytes it took. Raise OSError."""
        sent = 0
        try:
            while self._pieces and sent < MAX_UNREAD:
                piece = self._pieces[0][:MAX_UNREAD]
                count = self._sock.send(piece)
                sent += count
                if count < len(self._pieces[0]):
                    self._pieces[0] = self._pieces[0][count:]
                else:
                    self._pieces.popleft()
                if count < len(piece):
                    break
        except (BlockingIOError, InterruptedError):
            pass
        self.size -= sent
        return sent

    def clear(self) -> int:
        """Forget what waits; return how many bytes that was."""
        self._pieces.clear()
        size, self.size = self.size, 0
        return size
