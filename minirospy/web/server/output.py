"""One connection's output: the queue, and the transfer from the queue to the pipe."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING

from minirospy.web.server.files import FileAnswer, FileSender
from minirospy.web.server.queue import Piece, SendQueue

if TYPE_CHECKING:
    from minirospy.web.server.account import Share
    from minirospy.web.server.pipe import Pipe

__all__ = ["Output"]

_BATCH_BYTES = 256 * 1024  # maximum size in bytes of small messages combined into one write
_BATCH_PIECES = 128
# maximum number of bytes written per loop iteration to a client that reads fast
_PUMP_BYTES = 1024 * 1024


class Output:
    """Writes the data queued for a client, as fast as its pipe accepts it. Runs on the loop."""

    def __init__(
        self,
        pipe: Pipe,
        queue: SendQueue,
        share: Share,
        loop: asyncio.AbstractEventLoop,
        on_written: Callable[[], object],
    ) -> None:
        """Create the output.

        ``on_written`` is called after each write, so that the caller can update the client's memory use.
        """
        self.queue = queue
        self.progressed = loop.time()  # when output was last written to the pipe
        self._pipe = pipe
        self._share = share
        self._loop = loop
        self._on_written = on_written
        self._file: FileSender | None = None  # the file that is being sent
        # pieces that the pipe has not sent yet; the client's share counts only the large ones
        self._in_pipe: list[Piece] = []
        self._is_scheduled = False  # set by schedule() until the next iteration of the loop
        self._is_closing = False  # set by close_when_sent()
        self._is_ended = False  # set by end()

    @property
    def is_full(self) -> bool:
        """Return whether the pipe contains data that the client has not read."""
        return self._pipe.is_full

    @property
    def size(self) -> int:
        """Return the number of queued bytes that are for this client only.

        Large pieces are excluded: the client's share counts them.
        """
        queue = self.queue
        size = queue.size + queue.answers - queue.large
        if self._pipe.is_full:
            size += max(0, self._pipe.unsent - sum(map(len, self._in_pipe)))
        return size

    def schedule(self) -> None:
        """Write in the next iteration of the loop, so that messages queued until then are written together."""
        if not self._is_scheduled and not self._pipe.is_full:
            self._is_scheduled = True
            self._loop.call_soon(self.pump)

    def pump(self) -> None:
        """Write as much queued data as the pipe accepts."""
        self._is_scheduled = False
        if self._is_ended:
            return
        if not self._pipe.is_full:
            self._release_written()
        self._write()
        if self._share.size and not self._is_ended:
            self._on_written()

    def close_when_sent(self) -> None:
        """Close the pipe as soon as the queue is empty."""
        self._is_closing = True
        self.schedule()

    def abort(self) -> None:
        """Close the pipe without sending queued data."""
        self._is_closing = True
        self._pipe.close(flush=False)

    def end(self) -> None:
        """Release all data, because the pipe has closed."""
        self._is_ended = True
        self.queue.clear()
        if self._file:
            self._file.close()
        self._release_written()

    def _release_written(self) -> None:
        if self._in_pipe:
            self._share.release(self._in_pipe)
            self._in_pipe = []

    def _write(self) -> None:
        written = 0
        while not self._pipe.is_full:
            if written >= _PUMP_BYTES:
                self.schedule()
                return
            batch = self._next_batch()
            if batch is None:
                return
            self.progressed = self._loop.time()
            written += sum(map(len, batch))
            self._pipe.write(batch)
            if self._is_ended:
                return
            if self._pipe.is_full and not self._pipe.copies:
                self._in_pipe = batch
                self._share.hold(batch)

    def _next_batch(self) -> list[Piece] | None:
        """Return the pieces to write next, or None if there are none."""
        batch: list[Piece] = []
        size = 0
        while size < _BATCH_BYTES and len(batch) < _BATCH_PIECES and not self._file:
            pieces = self.queue.pop()
            if pieces is None:
                break
            if isinstance(pieces, FileAnswer):
                self._file = FileSender(pieces, self._loop, self.pump)
                break
            batch += pieces
            size += sum(map(len, pieces))
        if batch:
            return batch
        if self._file:
            return self._next_of_file(self._file)
        if self._is_closing:
            self._pipe.close()
        return None

    def _next_of_file(self, file: FileSender) -> list[Piece] | None:
        piece = file.take()
        if piece is None:
            if file.has_failed:
                # Close the pipe: the file's size has been sent, so the client would take any other data for the file.
                self.abort()
            return None
        if file.is_done:
            self._file = None
        return [piece]
