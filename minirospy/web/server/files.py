"""Files that are sent to clients in pieces: a worker reads a piece once the client has received the previous one.

Thus a mesh of 60 MB uses the memory of only one piece for each client, even if many clients request it and read nothing.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import BinaryIO

from minirospy.base.errors import BridgeError

__all__ = ["PIECE_BYTES", "FileAnswer", "FileSender"]

_log = logging.getLogger(__name__)

# bytes per read: large, so that a worker has little overhead; small enough for 256 clients at the same time
PIECE_BYTES = 128 * 1024


@dataclass(frozen=True)
class FileAnswer:
    """A response that ends with a file, which is not opened until it reaches the front of the queue."""

    open: Callable[[], tuple[BinaryIO, int]]
    """Returns the file and its size. Blocks; raises BridgeError, with the reason, if the file cannot be opened."""
    head: Callable[[int], bytes]
    """Returns the data to send before a file of this size."""
    failure: Callable[[str], bytes]
    """Returns the data to send instead if the file cannot be opened."""


class FileSender:
    """Sends a file to a client. Runs on the loop."""

    def __init__(
        self, answer: FileAnswer, loop: asyncio.AbstractEventLoop, on_piece: Callable[[], object]
    ) -> None:
        """Create the sender. ``on_piece`` is called when the next piece has been read or reading has failed."""
        self.is_done = False
        """True if all pieces have been taken."""
        self.has_failed = False
        """True if the file has become shorter or unreadable after its size was sent."""
        self._answer = answer
        self._loop = loop
        self._on_piece = on_piece
        self._file: BinaryIO | None = None
        self._left = 0
        """Bytes of the file that have not been read yet."""
        self._piece: bytes | None = None
        self._reading: asyncio.Future[bytes] | None = None
        self._is_closed = False

    def take(self) -> bytes | None:
        """Return the next piece of the file, or None while it is being read."""
        piece, self._piece = self._piece, None
        if piece is None:
            self._read()
        elif not self._left:
            self.is_done = True
            self.close()
        return piece

    def close(self) -> None:
        """Close the file, after the read in progress. Idempotent."""
        self._is_closed = True
        if self._file and not self._reading:
            self._file.close()

    def _read(self) -> None:
        if not self._reading and not self._is_closed:
            work = self._next if self._file else self._first
            self._reading = self._loop.run_in_executor(None, work)
            self._reading.add_done_callback(self._was_read)

    def _first(self) -> bytes:
        """Open the file; return the response's head and the file's first piece. Runs in a worker."""
        try:
            self._file, size = self._answer.open()
        except BridgeError as error:
            return self._answer.failure(str(error))
        self._left = size
        return self._answer.head(size) + (self._next() if size else b"")

    def _next(self) -> bytes:
        """Return the next piece of the file. Runs in a worker."""
        assert self._file
        piece = self._file.read(min(PIECE_BYTES, self._left))
        if not piece:
            raise OSError("it has become shorter meanwhile")
        self._left -= len(piece)
        return piece

    def _was_read(self, reading: asyncio.Future[bytes]) -> None:
        self._reading = None
        if self._is_closed:
            self.close()
            return
        if reading.cancelled() or (error := reading.exception()):
            self.has_failed = True
            _log.warning("a file could not be sent: %s", "cancelled" if reading.cancelled() else error)
            self.close()
        else:
            self._piece = reading.result()
        self._on_piece()
