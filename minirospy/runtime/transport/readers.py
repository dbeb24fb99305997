"""The subscriber's end of a link. A link is a connection that carries a topic's frames.

Frames are read in a worker (:func:`read_frames`) or on the loop (:func:`watch_frames`, :func:`watch_frames_in_turns`).
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

from minirospy.base.errors import WireError
from minirospy.base.steps import Steps
from minirospy.core.wire import ring
from minirospy.core.wire.framing import (
    CHUNK,
    LENGTH_BYTES,
    MAX_FRAME,
    SPLIT,
    SPLIT_BYTES,
    Frame,
    FrameReader,
    SplitFrame,
    check_split,
    parse_length,
    parse_split,
    split_frame,
)
from minirospy.runtime.transport.ring_receiver import RingReceiver
from minirospy.runtime.transport.sockets import (
    BUSY_POLL_SECONDS,
    FAMILIES,
    busy_receive,
    is_readable,
    may_busy_poll,
)

__all__ = ["QueueSize", "ReaderSet", "read_frames", "watch_frames", "watch_frames_in_turns"]

# bytes per receive for frames that are read in steps; each connection has a buffer of this size
_TURN_CHUNK = 4096

_DRAIN_BYTES = 64 * 1024 * 1024
# maximum bytes to allocate per receive, so that a large length prefix alone cannot make this process allocate much memory
_CLAIM = 16 * 1024 * 1024

_WAIT_ALL: int = getattr(socket, "MSG_WAITALL", 0)
_log = logging.getLogger(__name__)


class QueueSize(Protocol):
    """The number of frames to keep for a slow receiver. It may change at any time."""

    newest: int


@dataclass(eq=False)
class ReaderSet:
    """The readers of a node's topics. If only one reader is active, it may busy-poll for its next message.

    Two busy-polling readers would wait for each other's GIL, which takes longer than waking up.
    """

    last: object = None  # the reader that was active last


def read_frames(
    sock: socket.socket,
    deliver: Callable[[Frame], None],
    size: QueueSize,
    readers: ReaderSet,
    *,
    shares_memory: bool = False,
) -> None:
    """Read frames in the calling thread until the peer closes, then close the socket.

    If several frames are ready when the thread reads, only the newest ``size.newest`` of them are delivered (0: all), so that a
    slow receiver gets recent data. ``shares_memory``: the header declared that this process can map the publisher's memory. Raise
    OSError if the connection fails, WireError if the data is invalid.
    """
    source = _FrameSource(sock, readers, shares_memory=shares_memory)
    try:
        sock.setblocking(True)
        with contextlib.suppress(_Ended):
            while True:
                frames = source.read()
                if size.newest:
                    _deliver_newest(source, frames, deliver, size.newest)
                else:
                    for frame in frames:
                        deliver(frame)
    finally:
        if readers.last is source:
            readers.last = None
        source.close()


def watch_frames(
    loop: asyncio.AbstractEventLoop,
    sock: socket.socket,
    deliver: Callable[[memoryview], None],
    on_end: Callable[[], None],
    on_fault: Callable[[Exception], None],
) -> None:
    """Read frames on the loop, for callbacks so short that a thread per connection would cost more time.

    ``on_fault`` is called with the OSError or WireError that closed the connection, before ``on_end``.
    """
    reader = FrameReader()

    def readable() -> None:
        try:
            count = sock.recv_into(reader.space())
            for frame in reader.received(count):
                deliver(frame)
        except (BlockingIOError, InterruptedError):
            return
        except (OSError, WireError) as error:
            on_fault(error)
            count = 0
        except MemoryError:
            on_fault(WireError(f"no memory for a message of {reader.wanted} bytes"))
            count = 0
        if not count:
            loop.remove_reader(sock)
            sock.close()
            on_end()

    loop.add_reader(sock, readable)


def watch_frames_in_turns(
    loop: asyncio.AbstractEventLoop,
    sock: socket.socket,
    deliver: Callable[[memoryview], Steps[None]],
    on_end: Callable[[], None],
    start_steps: Callable[[Steps[None]], None],
    most: int,
    on_left_out: Callable[[], None],
) -> None:
    """Read frames on the loop in steps; ``start_steps`` interleaves the steps with those of other connections.

    Frames of more than ``most`` bytes are skipped; ``on_left_out`` is called for each.
    """
    reader = FrameReader(most, skips=True, chunk=_TURN_CHUNK)

    def readable() -> None:
        loop.remove_reader(sock)
        start_steps(read())

    def read() -> Steps[None]:
        if sock.fileno() < 0:
            # The socket was closed in the meantime.
            return
        skipped = reader.skipped
        try:
            count = sock.recv_into(reader.space())
            for frame in reader.received(count):
                yield from deliver(frame)
        except (BlockingIOError, InterruptedError):
            count = -1
        except (OSError, WireError) as error:
            _log.debug("connection ended: %s", error)
            count = 0

        if reader.skipped > skipped:
            on_left_out()
        if count:
            loop.add_reader(sock, readable)
        else:
            sock.close()
            on_end()

    loop.add_reader(sock, readable)


class _FrameSource:
    """Reads frames from a blocking socket: small ones together into one buffer, each large one into separate memory."""

    def __init__(self, sock: socket.socket, readers: ReaderSet, *, shares_memory: bool = False) -> None:
        self.sock = sock
        self._readers = readers
        self._reader = FrameReader(gathers=False)
        self._rest = b""
        self._was_large = False
        self._may_busy_poll = may_busy_poll(sock)
        self._is_fast = False
        # On a Unix socket, a reset means end of file.
        # Linux reports it, after all data, if the publisher closed before reading an answer about shared memory.
        self._is_unix = sock.family not in FAMILIES
        self._ring = RingReceiver() if shares_memory else None

    def close(self) -> None:
        """Close the socket and the shared memory."""
        self.sock.close()
        if self._ring:
            self._ring.close()

    def read(self) -> Iterable[Frame]:
        """Wait for the next frames. Small frames are valid only until the next call; large frames stay valid.

        Raise _Ended if the peer closes, OSError if the connection fails, WireError if the data is invalid.
        """
        reader = self._reader
        if self._was_large:
            # Another large frame is likely, so do not read its first bytes into the buffer for small frames.
            word = self._take(LENGTH_BYTES)
            length = parse_length(word)
            if length > CHUNK:
                return self._follow(length)
            self._was_large = False
            reader.put_back(word)
        count = self._receive(reader.space())
        if not count:
            raise _Ended
        return self._small(count)

    def _receive(self, space: memoryview) -> int:
        """Wait for bytes; busy-poll if the previous ones arrived faster than a thread wakes up."""
        try:
            return self._receive_some(space)
        except ConnectionResetError:
            if self._is_unix:
                return 0
            raise

    def _receive_some(self, space: memoryview) -> int:
        if self._ring and self._ring.expects_files:
            data = self._ring.receive(self.sock, len(space))
            space[: len(data)] = data
            return len(data)
        start = time.perf_counter()
        count = None
        if self._is_fast and self._readers.last is self:
            with contextlib.suppress(BlockingIOError):
                count = busy_receive(self.sock, space)
        if count is None:
            count = self.sock.recv_into(space)
        # The flag is also False if bytes were ready but this thread had to wait for the GIL:
        # busy-polling would then slow down the other threads, which need the GIL.
        self._is_fast = self._may_busy_poll and time.perf_counter() - start < BUSY_POLL_SECONDS
        self._readers.last = self
        return count

    def _small(self, count: int) -> Iterator[Frame]:
        reader = self._reader
        yield from reader.received(count)
        while reader.unfinished:
            (length, self._rest), reader.unfinished = reader.unfinished, None
            self._was_large = True
            yield from self._follow(length)
            if not self._rest:
                return
            # Control messages about shared memory are short, so other frames may have arrived with them.
            rest, self._rest = self._rest, b""
            self._was_large = False
            reader.put_back(rest)
            yield from reader.received(0)

    def _follow(self, word: int) -> tuple[Frame, ...]:
        """Return the frame of length ``word``, or handle ``word`` if it is the code of a control message about shared memory."""
        if not self._ring or word < ring.PREPARE_WORD:
            return (self._large(word),)
        if word == ring.PLACE_WORD:
            where = self._take(ring.ANNOUNCEMENT_BYTES)
            try:
                return (self._ring.read(where),)
            except MemoryError:
                raise WireError("no memory for a message in shared memory") from None
        if word == ring.PREPARE_WORD:
            self._ring.prepare(self.sock)
        elif word == ring.OFFER_WORD:
            self._ring.take_offer(self.sock, self._take(ring.OFFER_BYTES))
        else:
            raise WireError(f"a message of {word} bytes is over the limit of {MAX_FRAME}")
        return ()

    def _large(self, word: int) -> Frame:
        size = word & ~SPLIT
        if size > MAX_FRAME:
            raise WireError(f"a message of {word} bytes is over the limit of {MAX_FRAME}")
        try:
            if not word & SPLIT:
                return self._take(size)
            array, rest = parse_split(self._take(SPLIT_BYTES))
            parts = [self._take(count) for count in (check_split(size, array, rest), array, rest) if count]
        except MemoryError:
            raise WireError(f"no memory for a message of {size} bytes") from None
        return split_frame(*parts)

    def _take(self, count: int) -> bytes:
        """Return exactly ``count`` bytes. Raise _Ended if the peer closes, OSError if the connection fails."""
        if not self._rest:
            data = self._receive_bytes(count)
            if len(data) == count:
                return data
            if not data:
                raise _Ended
        else:
            data, self._rest = self._rest[:count], self._rest[count:]
            if len(data) == count:
                return data

        parts = [data]
        missing = count - len(data)
        while missing:
            data = self._receive_bytes(missing)
            if not data:
                raise _Ended
            parts.append(data)
            missing -= len(data)
        return b"".join(parts)

    def _receive_bytes(self, count: int) -> bytes:
        try:
            if self._ring and self._ring.expects_files:
                return self._ring.receive(self.sock, min(count, _CLAIM), _WAIT_ALL)
            return self.sock.recv(min(count, _CLAIM), _WAIT_ALL)
        except ConnectionResetError:
            if self._is_unix:
                return b""
            raise


def _deliver_newest(
    source: _FrameSource, frames: Iterable[Frame], deliver: Callable[[Frame], None], newest: int
) -> None:
    """Read while frames are ready, then deliver the newest ones, even if the connection ends or fails meanwhile."""
    kept: deque[Frame] = deque(maxlen=newest)
    total = 0
    end: Exception | None = None

    try:
        while True:
            for frame in frames:
                total += len(frame)
                # Copy a small frame, because the next receive overwrites the reader's buffer.
                kept.append(frame if isinstance(frame, bytes) else bytes(frame))
            if total >= _DRAIN_BYTES or not is_readable(source.sock):
                break
            frames = source.read()
    except (_Ended, OSError, WireError) as error:
        end = error

    for frame in kept:
        deliver(frame if isinstance(frame, SplitFrame) else memoryview(frame))
    if end:
        raise end


class _Ended(Exception):
    """The peer has closed the connection."""
