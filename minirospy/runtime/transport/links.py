"""The publisher's end of a link. A link is a connection that carries a topic's frames. Any thread may write.

The subscriber's end is in :mod:`minirospy.runtime.transport.readers`.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from itertools import islice
from typing import TYPE_CHECKING

from minirospy.base.clock import SignalSafeCondition
from minirospy.core.wire import ring as ring_limits
from minirospy.core.wire.framing import LargeFrame
from minirospy.runtime.transport import shared_memory
from minirospy.runtime.transport.sockets import FAMILIES, is_writable

if TYPE_CHECKING:
    from minirospy.runtime.transport.ring_sender import RingSender, Sharing

__all__ = ["OutLink"]

_GATHER = 64
# seconds for which a publishing thread itself tries to write a large message to the socket
_PUSH_SECONDS = 0.005
_PUSH_WAIT_MS = 1  # milliseconds per wait for space in the socket's buffer

# a frame in an outbox: the whole frame, or the buffers that are not sent yet
_Waiting = bytes | list[bytes | memoryview]


class OutLink:
    """The publisher's end of one connection: sends frames from any thread, in order, without blocking the publisher.

    The sending thread writes a frame immediately. Data that the socket does not accept is queued in the outbox, which the
    loop sends; if more than ``queue_size`` frames are queued, the oldest is dropped (0: no limit). Before dropping, the thread
    waits a few milliseconds for space, but only if the peer is on this machine and has read since the last wait.
    ``header`` is sent first, when the link is opened; frames that are published before that are queued after it.
    With ``split`` large messages are sent as split frames if possible. With ``ring`` they go through shared memory if possible.
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
        ring: RingSender | None = None,
    ) -> None:
        self.peer = peer
        self.address = "unknown"
        self.local_port = 0
        self.transport = "TCPROS"
        self.queue_size = queue_size
        self.sent_bytes = len(header)
        self.sent = 0
        self.dropped = 0
        self.large = 0  # number of large messages: long enough for shared memory
        self._last_large = 0  # size in bytes of the last large message
        self.ring = ring  # this end of the shared memory, or None if the subscriber cannot read any

        self._is_same_host = sock.family not in FAMILIES
        if self._is_same_host:
            self.address, self.transport = "unix", "UNIXROS"
        else:
            with contextlib.suppress(OSError):
                host, port = sock.getpeername()[:2]
                self.address = f"{host}:{port}"
                own_host, self.local_port = sock.getsockname()[:2]
                self._is_same_host = host == own_host

        self._sock = sock
        self._loop = loop
        self._on_closed = on_closed
        self._split = split
        self._outbox: deque[_Waiting] = deque([[header]] if header else [])
        self._begun = bool(header)
        self._is_reading = True
        self._lock = threading.Lock()
        self._drained = SignalSafeCondition()
        self._closed = False
        self._loop_thread = threading.get_ident()

    @property
    def number(self) -> int:
        """The link's number within the node: its file descriptor."""
        return self._sock.fileno()

    @property
    def waiting(self) -> int:
        """Return the number of frames in the queue."""
        return len(self._outbox)

    @property
    def waiting_bytes(self) -> int:
        """Return the number of bytes in the queue."""
        with self._lock:
            return sum(
                len(frame) if isinstance(frame, bytes) else sum(map(len, frame)) for frame in self._outbox
            )

    @property
    def shared(self) -> int:
        """Return the number of messages that went through shared memory."""
        return self.ring.announced if self.ring else 0

    @property
    def obstacle(self) -> str:
        """Return the reason why large messages do not go through shared memory, or "" if they do or there were none."""
        if not self.large:
            return ""
        if self.ring:
            return self.ring.obstacle(self.large, self._last_large)
        try:
            return shared_memory.obstacle(self._sock, is_same_host=self._is_same_host)
        except OSError:
            return "the connection has ended"

    @property
    def is_sending(self) -> bool:
        """Return whether a thread is inside :meth:`send`. A signal handler that publishes could then deadlock."""
        return self._lock.locked()

    def open(self) -> None:
        """Send the header, and watch for the peer to disconnect. Call this on the loop."""
        self._loop_thread = threading.get_ident()
        self._loop.add_reader(self._sock, self._readable)
        with self._lock:
            self._help()
        self._start_writing()

    def send(self, frame: bytes | LargeFrame, sharing: Sharing | None = None) -> None:
        """Send ``frame`` immediately, or queue it after the pending ones. ``sharing`` can write it into shared memory."""
        with self._lock:
            if self._closed:
                return
            self.sent += 1
            if isinstance(frame, LargeFrame):
                self._send_large(frame, sharing)
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
        """Wait until the queue is empty, or the link is closed. Do not call this on the loop."""
        self._drained.wait_for(lambda: not self._outbox or self._closed)

    async def drain(self, timeout: float) -> None:
        """Like :meth:`wait`, but on the loop, for at most ``timeout`` seconds."""
        end = self._loop.time() + timeout
        while self._outbox and self._loop.time() < end:
            await asyncio.sleep(0.005)

    def close(self) -> None:
        """Close the connection. Call this on the loop. Idempotent."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self._outbox.clear()
            self._drained.notify_all()
            if self.ring:
                self.ring.close()
        self._loop.remove_reader(self._sock)
        self._loop.remove_writer(self._sock)
        self._sock.close()
        self._on_closed(self)

    def _has_to_wait(self, frame: _Waiting) -> bool:
        """Append ``frame`` to the outbox and return True. Return False if the outbox has become empty in the meantime."""
        outbox = self._outbox
        if not self.sent % _GATHER or (self._is_reading and self._is_full()):
            # Send from this thread: if it publishes without pause, the loop's thread gets no chance to send.
            self._help()
            if not outbox:
                return False
        if self._is_full():
            # The first frame may have been sent in part, so it must not be dropped.
            del outbox[1 if self._begun else 0]
            self.dropped += 1
        outbox.append(frame)
        return True

    def _is_full(self) -> bool:
        return bool(self.queue_size) and len(self._outbox) - self._begun >= self.queue_size

    def _help(self) -> None:
        """Send as much as the socket accepts; if the outbox is full, wait briefly for space."""
        end = time.monotonic() + _PUSH_SECONDS
        while True:
            # Ignore errors here; the loop detects them.
            with contextlib.suppress(OSError):
                while self._outbox:
                    self._write_some()
            if not self._is_full() or not self._is_reading or not self._may_stay() or time.monotonic() > end:
                break
            self._is_reading = is_writable(self._sock, _PUSH_WAIT_MS)
        if not self._outbox:
            self._drained.notify_all()

    def _send_large(self, frame: LargeFrame, sharing: Sharing | None) -> None:
        buffers: list[bytes | memoryview] = [*frame.buffers(split=self._split)]
        self.sent_bytes += 4 + frame.size
        if frame.size >= ring_limits.MIN_MESSAGE:
            self.large += 1
            self._last_large = frame.size
        if self._outbox and self._has_to_wait(buffers):
            return
        if sharing and self.ring:
            # Announce the message only if the outbox is empty, because announcements and frames must arrive in order.
            try:
                if self.ring.announce(sharing, may_wait=self._may_stay()):
                    return
            except OSError:
                self._post(self.close)
                return

        size = sum(map(len, buffers))
        left = size
        end = time.monotonic() + _PUSH_SECONDS
        while True:
            # A socket does not accept a large message in one call, but a reading peer frees space within microseconds.
            # Waiting here is cheaper than handing each step to the loop.
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
        """Return whether this thread may wait briefly: it is not the loop's thread, and the peer reads within microseconds."""
        return self._is_same_host and threading.get_ident() != self._loop_thread

    def _gather(self, buffers: list[bytes | memoryview]) -> int:
        """Send as much of ``buffers`` as possible, remove the sent bytes, and return the number of bytes sent.

        Raise OSError if the connection has failed.
        """
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
        if not self._lock.acquire(blocking=False):
            # A publishing thread is already sending, so stop watching the socket for a moment.
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
            self._lock.release()

    def _write_some(self) -> None:
        """Send part of the queue. Raise OSError if the connection has failed."""
        outbox = self._outbox
        if isinstance(outbox[0], list):
            # Do not combine a large or partly sent frame with small frames.
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
        """Close the link at end of file. A subscriber sends no data except answers about shared memory."""
        try:
            if data := self._sock.recv(4096):
                if self.ring:
                    self.ring.answered(data)
                return
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            pass
        self.close()


def _take_off(buffers: list[bytes | memoryview], count: int) -> None:
    """Drop the first ``count`` bytes from ``buffers``."""
    while count:
        first = buffers[0]
        if count < len(first):
            buffers[0] = memoryview(first)[count:]
            return
        count -= len(first)
        del buffers[0]
