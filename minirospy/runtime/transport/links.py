"""Links: connections that carry a topic's frames, after the handshake.

A publisher's end (:class:`OutLink`) is written by any thread, a subscriber's is read by a worker
(:func:`read_frames`) or on the loop (:func:`watch_frames`).
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Protocol

from minirospy.errors import WireError
from minirospy.runtime.transport.sockets import (
    BUSY_POLL_SECONDS,
    FAMILIES,
    busy_receive,
    is_readable,
    is_writable,
    may_busy_poll,
)
from minirospy.steps import Steps
from minirospy.wire.framing import (
    CHUNK,
    LENGTH_BYTES,
    MAX_FRAME,
    SPLIT,
    Frame,
    FrameReader,
    LargeFrame,
    SplitFrame,
    may_split,
    parse_length,
    split_sizes,
)

__all__ = ["OutLink", "QueueSize", "ReaderSet", "read_frames", "watch_frames", "watch_frames_in_turns"]

_GATHER = 64
_TURN_CHUNK = 4096
"""Bytes that are received at a time, and kept for each connection, where frames are read in turns."""

_DRAIN_BYTES = 64 * 1024 * 1024
_CLAIM = 16 * 1024 * 1024
"""Largest receive, in bytes: a length is only a claim until the bytes arrive."""

_PUSH_SECONDS = 0.005
_PUSH_WAIT_MS = 1
"""How long the thread that publishes a large message writes it into the socket, and waits for one step."""

_WAIT_ALL: int = getattr(socket, "MSG_WAITALL", 0)
_log = logging.getLogger(__name__)

_Waiting = bytes | list[bytes | memoryview]
"""A frame in an outbox: whole, or what is left of its buffers."""


class OutLink:
    """The publisher's end of one connection: frames from any thread, in order, without blocking the publisher.

    A frame is written immediately by the thread that sends it. What the socket does not take waits in the
    outbox, which the loop empties; beyond ``queue_size`` waiting frames the oldest is dropped (0: no limit).
    Before that a thread waits for room, a few milliseconds at most, but only for a peer on this machine that has read
    since the last wait.
    ``header`` is sent first, when the link is opened; frames that are published before that wait behind it.
    With ``split`` large messages are sent as split frames where they can be.
    """

    def __init__(
        self,
        sock: socket.socket,
        loop: asyncio.AbstractEventLoop,
        peer: str,
        queue_size: int,
        on_closed: Callable[[OutLink], None],
        *,
        header: bytes = b"",
        split: bool = False,
    ) -> None:
        self.peer = peer
        self.address = "unknown"
        self.transport = "TCPROS"
        self.queue_size = queue_size
        self.sent_bytes = 0
        self.sent = 0
        self.dropped = 0

        self._is_same_host = sock.family not in FAMILIES
        if self._is_same_host:
            self.address, self.transport = "unix", "UNIXROS"
        else:
            with contextlib.suppress(OSError):
                host, port = sock.getpeername()[:2]
                self.address = f"{host}:{port}"
                self._is_same_host = host == sock.getsockname()[0]

        self._sock = sock
        self._loop = loop
        self._on_closed = on_closed
        self._split = split
        self._outbox: deque[_Waiting] = deque([[header]] if header else [])
        self._begun = bool(header)
        self._is_reading = True
        self._lock = threading.Lock()
        self._drained = threading.Condition(self._lock)
        self._closed = False
        self._loop_thread = threading.get_ident()

    @property
    def number(self) -> int:
        """The link's number among those of the node: its file descriptor."""
        return self._sock.fileno()

    @property
    def waiting(self) -> int:
        """Return the number of frames that wait for the socket to take them."""
        return len(self._outbox)

    @property
    def is_sending(self) -> bool:
        """Return whether a thread is inside :meth:`send`: a signal's handler in that very thread would wait for itself."""
        return self._lock.locked()

    def open(self) -> None:
        """Send the header, and watch for the peer's hanging up (on the loop)."""
        self._loop_thread = threading.get_ident()
        self._loop.add_reader(self._sock, self._readable)
        with self._drained:
            self._help()
        self._start_writing()

    def send(self, frame: bytes | LargeFrame) -> None:
        """Send ``frame``: immediately, or after the queued ones."""
        with self._drained:
            if self._closed:
                return
            self.sent += 1
            if isinstance(frame, LargeFrame):
                self._send_large(frame)
                return
            self.sent_bytes += len(frame)
            if self._outbox and self._has_to_wait(frame):
                return

            try:
                count = self._sock.send(frame)
            except (BlockingIOError, InterruptedError):
                count = 0
            except OSError:
                self._post(self.close)
                return
            if count == len(frame):
                return
            self._begun = count > 0
            self._outbox.append([memoryview(frame)[count:]] if count else frame)
            self._post(self._start_writing)

    def wait(self) -> None:
        """Return when the socket has taken all that waits, or the link is closed (not on the loop)."""
        with self._drained:
            self._drained.wait_for(lambda: not self._outbox or self._closed)

    async def drain(self, timeout: float) -> None:
        """Do the same on the loop, for at most ``timeout`` seconds."""
        end = self._loop.time() + timeout
        while self._outbox and self._loop.time() < end:
            await asyncio.sleep(0.005)

    def close(self) -> None:
        """End the connection (on the loop). Idempotent."""
        with self._drained:
            if self._closed:
                return
            self._closed = True
            self._outbox.clear()
            self._drained.notify_all()
        self._loop.remove_reader(self._sock)
        self._loop.remove_writer(self._sock)
        self._sock.close()
        self._on_closed(self)

    def _has_to_wait(self, frame: _Waiting) -> bool:
        """Put ``frame`` behind those that wait; False where meanwhile they have all gone."""
        outbox = self._outbox
        if not self.sent % _GATHER or (self._is_reading and self._is_full()):
            # A thread that publishes without a pause would not let the loop's come to it.
            self._help()
            if not outbox:
                return False
        if self._is_full():
            # The frame in front may be half on its way: that one has to stay.
            del outbox[1 if self._begun else 0]
            self.dropped += 1
        outbox.append(frame)
        return True

    def _is_full(self) -> bool:
        return bool(self.queue_size) and len(self._outbox) - self._begun >= self.queue_size

    def _help(self) -> None:
        """Write what the socket takes; where the outbox is full, wait a little for room."""
        end = time.monotonic() + _PUSH_SECONDS
        while True:
            # Whom it fails with, the loop finds out.
            with contextlib.suppress(OSError):
                while self._outbox:
                    self._write_some()
            if not self._is_full() or not self._is_reading or not self._may_stay() or time.monotonic() > end:
                break
            self._is_reading = is_writable(self._sock, _PUSH_WAIT_MS)
        if not self._outbox:
            self._drained.notify_all()

    def _send_large(self, frame: LargeFrame) -> None:
        buffers: list[bytes | memoryview] = [*frame.buffers(split=self._split)]
        self.sent_bytes += 4 + frame.size
        if self._outbox and self._has_to_wait(buffers):
            return

        size = sum(map(len, buffers))
        left = size
        end = time.monotonic() + _PUSH_SECONDS
        while True:
            # No socket takes a large message in one call, and a peer that reads makes room in microseconds: to hand
            # each step to the loop would cost more than to stay.
            try:
                left -= self._gather(buffers)
            except (BlockingIOError, InterruptedError):
                pass
            except OSError:
                self._post(self.close)
                return
            if not left:
                return
            if not self._may_stay() or time.monotonic() > end or not is_writable(self._sock, _PUSH_WAIT_MS):
                break

        self._begun = left < size
        self._outbox.append(buffers)
        self._post(self._start_writing)

    def _may_stay(self) -> bool:
        """Return whether this thread may wait a moment: it is not the loop's, and the peer answers in microseconds."""
        return self._is_same_host and threading.get_ident() != self._loop_thread

    def _gather(self, buffers: list[bytes | memoryview]) -> int:
        """Write some of ``buffers``, take it off them, and return how many bytes it was. Raises OSError."""
        # Windows has no sendmsg.
        gather = getattr(self._sock, "sendmsg", None)
        count: int = gather(buffers) if gather else self._sock.send(buffers[0])
        _take_off(buffers, count)
        return count

    def _post(self, function: Callable[[], None]) -> None:
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(function)

    def _start_writing(self) -> None:
        if not self._closed and self._outbox:
            self._loop.add_writer(self._sock, self._writable)
            self._writable()

    def _writable(self) -> None:
        if not self._drained.acquire(blocking=False):
            # A thread that publishes is at it, and the loop has others to serve.
            self._loop.remove_writer(self._sock)
            self._loop.call_later(_PUSH_SECONDS, self._start_writing)
            return

        try:
            if self._closed:
                return
            try:
                if self._outbox:
                    self._write_some()
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                self._loop.call_soon(self.close)
                return
            if not self._outbox:
                self._loop.remove_writer(self._sock)
                self._drained.notify_all()
        finally:
            self._drained.release()

    def _write_some(self) -> None:
        """Write some of what waits. Raises OSError."""
        outbox = self._outbox
        if isinstance(outbox[0], list):
            # A partly sent frame, and a large one, is sent alone.
            self._gather(outbox[0])
            self._begun = self._is_reading = True
            if not outbox[0]:
                outbox.popleft()
                self._begun = False
            return

        small: list[bytes] = []
        for frame in islice(outbox, _GATHER):
            if isinstance(frame, list):
                break
            small.append(frame)
        gather = getattr(self._sock, "sendmsg", None)
        count = gather(small) if gather else self._sock.send(b"".join(small))
        self._is_reading = True
        for frame in small:
            if count < len(frame):
                if count:
                    outbox[0] = [memoryview(frame)[count:]]
                    self._begun = True
                return
            count -= len(frame)
            outbox.popleft()

    def _readable(self) -> None:
        """Close the link: a subscriber sends nothing, so what becomes readable is its end."""
        try:
            if self._sock.recv(4096):
                return
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            pass
        self.close()


class QueueSize(Protocol):
    """The number of frames kept for a slow receiver; it may change at any time."""

    newest: int


@dataclass(eq=False)
class ReaderSet:
    """The readers of a node's topics. A reader that is the only active one may busy-poll for its next message.

    Two would wait for each other's GIL, which takes longer than to be woken.
    """

    last: object = None
    """The reader that has read last."""


def read_frames(
    sock: socket.socket, deliver: Callable[[Frame], None], size: QueueSize, readers: ReaderSet
) -> None:
    """Read frames in the calling thread until the peer ends; closes the socket.

    ``size.newest``: of what is ready when the thread reads, only so many frames, the newest, are
    delivered (0: all), so that a slow receiver sees the present. Raises OSError or WireError.
    """
    source = _FrameSource(sock, readers)
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
        sock.close()


def watch_frames(
    loop: asyncio.AbstractEventLoop,
    sock: socket.socket,
    deliver: Callable[[memoryview], None],
    on_end: Callable[[], None],
) -> None:
    """Read frames on the loop: for receivers that do so little that a thread each would cost more."""
    reader = FrameReader()

    def readable() -> None:
        try:
            count = sock.recv_into(reader.space())
            for frame in reader.received(count):
                deliver(frame)
        except (BlockingIOError, InterruptedError):
            return
        except (OSError, WireError) as error:
            _log.debug("connection ended: %s", error)
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
    """Read frames on the loop in steps, which ``start_steps`` runs in turns with those of other connections.

    Frames of more than ``most`` bytes are left out; ``on_left_out`` is called when one comes.
    """
    reader = FrameReader(most, skips=True, chunk=_TURN_CHUNK)

    def readable() -> None:
        loop.remove_reader(sock)
        start_steps(read())

    def read() -> Steps[None]:
        if sock.fileno() < 0:
            # It was closed meanwhile.
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
    """Frames off a blocking socket: small ones by the bufferful, each large one in its own memory."""

    def __init__(self, sock: socket.socket, readers: ReaderSet) -> None:
        self.sock = sock
        self._readers = readers
        self._reader = FrameReader(gathers=False)
        self._rest = b""
        self._was_large = False
        self._may_busy_poll = may_busy_poll(sock)
        self._is_fast = False

    def read(self) -> Iterable[Frame]:
        """Wait for the next frames; they are valid until the next call, large ones for good.

        Raises _Ended, OSError, WireError.
        """
        reader = self._reader
        if self._was_large:
            # Another large one is likely: its first bytes are kept out of the small ones' buffer.
            word = self._take(LENGTH_BYTES)
            length = parse_length(word)
            if length > CHUNK:
                return (self._large(length),)
            self._was_large = False
            reader.put_back(word)
        count = self._receive(reader.space())
        if not count:
            raise _Ended
        return self._small(count)

    def _receive(self, space: memoryview) -> int:
        """Wait for bytes; busy-poll where the last ones came within the time that waking up takes."""
        start = time.perf_counter()
        count = None
        if self._is_fast and self._readers.last is self:
            with contextlib.suppress(BlockingIOError):
                count = busy_receive(self.sock, space)
        if count is None:
            count = self.sock.recv_into(space)
        # Also where the bytes were there, but the GIL was not: other threads of this process need it.
        self._is_fast = self._may_busy_poll and time.perf_counter() - start < BUSY_POLL_SECONDS
        self._readers.last = self
        return count

    def _small(self, count: int) -> Iterator[Frame]:
        reader = self._reader
        yield from reader.received(count)
        if reader.unfinished:
            (length, self._rest), reader.unfinished = reader.unfinished, None
            self._was_large = True
            yield self._large(length)

    def _large(self, word: int) -> Frame:
        size = word & ~SPLIT
        if size > MAX_FRAME:
            raise WireError(f"a message of {word} bytes is over the limit of {MAX_FRAME}")
        try:
            if not word & SPLIT:
                return self._take(size)
            head_size, tail_size = split_sizes(size, parse_length(self._take(LENGTH_BYTES)))
            head, tail = self._take(head_size), self._take(tail_size)
        except MemoryError:
            raise WireError(f"no memory for a message of {size} bytes") from None
        if not may_split(head, tail_size):
            raise WireError("a split message was not split where its array begins")
        return SplitFrame(head, tail)

    def _take(self, count: int) -> bytes:
        """Return exactly ``count`` bytes. Raises _Ended, OSError."""
        if not self._rest:
            data = self.sock.recv(min(count, _CLAIM), _WAIT_ALL)
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
            data = self.sock.recv(min(missing, _CLAIM), _WAIT_ALL)
            if not data:
                raise _Ended
            parts.append(data)
            missing -= len(data)
        return b"".join(parts)


def _deliver_newest(
    source: _FrameSource, frames: Iterable[Frame], deliver: Callable[[Frame], None], newest: int
) -> None:
    """Read on while something is ready, then deliver the newest frames."""
    kept: deque[Frame] = deque(maxlen=newest)
    total = 0
    ended = False

    while True:
        for frame in frames:
            total += len(frame)
            # A small frame is in the reader's buffer, which the next receive reuses.
            kept.append(frame if isinstance(frame, bytes) else bytes(frame))
        if total >= _DRAIN_BYTES or not is_readable(source.sock):
            break
        try:
            frames = source.read()
        except _Ended:
            ended = True
            break

    for frame in kept:
        deliver(frame if isinstance(frame, SplitFrame) else memoryview(frame))
    if ended:
        raise _Ended


class _Ended(Exception):
    """The peer has ended the connection."""


def _take_off(buffers: list[bytes | memoryview], count: int) -> None:
    """Take the first ``count`` bytes off ``buffers``."""
    while count:
        first = buffers[0]
        if count < len(first):
            buffers[0] = memoryview(first)[count:]
            return
        count -= len(first)
        del buffers[0]
