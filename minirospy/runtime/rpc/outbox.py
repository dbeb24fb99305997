"""A queue of response bytes that a client has not read yet."""

from __future__ import annotations

import socket
from collections import deque
from collections.abc import Sequence

__all__ = ["MAX_UNREAD", "Outbox"]

MAX_UNREAD = 256 * 1024  # maximum unread bytes; a client with more gets no further responses


class Outbox:
    """A queue of bytes to send on a non-blocking socket. Truthy while bytes are queued."""

    __slots__ = ("_pieces", "_sock", "size")

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self._pieces: deque[memoryview] = deque()
        self.size = 0  # number of bytes in the queue

    def __bool__(self) -> bool:
        """Return whether the queue contains bytes."""
        return self.size > 0

    def write(self, pieces: Sequence[bytes]) -> int:
        """Send as much as the socket accepts, and queue the rest; return the number of bytes queued.

        Raise OSError if the connection has failed.
        """
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
        """Send as much queued data as the socket accepts; return the number of bytes sent.

        Raise OSError if the connection has failed.
        """
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
        """Discard the queue; return the number of bytes discarded."""
        self._pieces.clear()
        size, self.size = self.size, 0
        return size
