"""Sockets: listening, connecting, and the exact reads of a handshake, on the loop; links that carry frames.

A handshake reads exactly a header's bytes, so nothing of what follows is ever taken with it, and the
socket can be handed to a worker or a writer as it is.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import select
import socket
import struct
import sys
import threading
from collections import deque
from collections.abc import Awaitable, Callable, Iterator
from types import FrameType

from minirospy.errors import WireError
from minirospy.wire.framing import FrameReader
from minirospy.wire.header import MAX_HEADER, Header, parse_header, serialize_header

__all__ = [
    "HANDSHAKE_SECONDS",
    "Listener",
    "OutLink",
    "connect",
    "hang_up",
    "is_sending",
    "read_frames",
    "receive_header",
    "send_header",
    "tune",
    "watch_frames",
]

HANDSHAKE_SECONDS = 10.0
"""Others may never answer: each handshake ends after this."""

_GATHER = 64
_DRAIN_BYTES = 64 * 1024 * 1024
_log = logging.getLogger(__name__)


def tune(sock: socket.socket, *, nodelay: bool = True) -> None:
    """TCP_NODELAY as asked; keepalive, so that a peer that lost power is noticed within a minute."""
    if nodelay:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in (("TCP_KEEPIDLE", 20), ("TCP_KEEPINTVL", 10), ("TCP_KEEPCNT", 3)):
        if hasattr(socket, option):
            with contextlib.suppress(OSError):
                sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)


def hang_up(sock: socket.socket) -> None:
    """End a connection; a thread that is blocked in a read of it wakes up and closes it."""
    with contextlib.suppress(OSError):
        sock.shutdown(socket.SHUT_RDWR)


async def connect(host: str, port: int, timeout: float = HANDSHAKE_SECONDS) -> socket.socket:
    """A connected, non-blocking socket. Raises OSError, also where the time is up."""
    loop = asyncio.get_running_loop()
    last: OSError = OSError(f"{host} has no address")
    with _time_limit(f"connecting to {host}:{port}"):
        infos = await asyncio.wait_for(loop.getaddrinfo(host, port, type=socket.SOCK_STREAM), timeout)
    # Servers of ROS 1 listen on IPv4, and many resolvers name IPv6 first.
    for family, kind, protocol, _, address in sorted(infos, key=lambda info: info[0] != socket.AF_INET):
        sock = socket.socket(family, kind, protocol)
        sock.setblocking(False)
        try:
            with _time_limit(f"connecting to {host}:{port}"):
                await asyncio.wait_for(loop.sock_connect(sock, address), timeout)
        except OSError as error:
            sock.close()
            last = error
        except BaseException:
            sock.close()
            raise
        else:
            return sock
    raise last


async def receive_header(sock: socket.socket, timeout: float = HANDSHAKE_SECONDS) -> Header:
    """The peer's connection header. Raises WireError or OSError."""
    with _time_limit("waiting for a connection header"):
        return await asyncio.wait_for(_receive_header(sock), timeout)


async def send_header(sock: socket.socket, fields: Header) -> None:
    """Send a connection header."""
    await asyncio.get_running_loop().sock_sendall(sock, serialize_header(fields))


class Listener:
    """A listening TCP socket; each connection is handed to ``accept`` in a task of its own."""

    def __init__(self, accept: Callable[[socket.socket, str], Awaitable[None]]) -> None:
        self._accept = accept
        self._sock: socket.socket | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self.port = 0

    def open(self, host: str, port: int = 0) -> None:
        """Listen on ``host``; port 0 takes a free one. Raises OSError."""
        sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            if sys.platform != "win32":
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            sock.bind((host, port))
            sock.listen(socket.SOMAXCONN)
            sock.setblocking(False)
        except BaseException:
            sock.close()
            raise
        self._sock = sock
        self.port = sock.getsockname()[1]
        self._spawn(self._serve(sock))

    async def close(self) -> None:
        """Stop listening, and end handshakes that are under way."""
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._sock is not None:
            self._sock.close()
            self._sock = None

    async def _serve(self, sock: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                peer, address = await loop.sock_accept(sock)
            except OSError as error:
                # Out of file descriptors, or the peer has gone already: the next one may do.
                _log.warning("a connection could not be accepted: %s", error)
                await asyncio.sleep(0.05)
                continue
            peer.setblocking(False)
            self._spawn(self._handle(peer, f"{address[0]}:{address[1]}"))

    async def _handle(self, peer: socket.socket, address: str) -> None:
        try:
            await self._accept(peer, address)
        except (OSError, WireError) as error:
            _log.warning("connection from %s refused: %s", address, error)
            peer.close()
        except BaseException:
            peer.close()
            raise

    def _spawn(self, work: Awaitable[None]) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


class OutLink:
    """The publisher's end of one connection: frames from any thread, in order, and never in the way.

    A frame is written at once by the thread that sends it. What the socket does not take waits in the
    outbox, which the loop empties; beyond ``queue_size`` waiting frames the oldest is dropped (0: no limit).
    """

    def __init__(
        self,
        sock: socket.socket,
        loop: asyncio.AbstractEventLoop,
        peer: str,
        queue_size: int,
        on_closed: Callable[[OutLink], None],
    ) -> None:
        self.peer = peer
        self.address = "unknown"
        self.queue_size = queue_size
        self.sent_bytes = 0
        self.sent = 0
        self.dropped = 0
        with contextlib.suppress(OSError):
            self.address = "{}:{}".format(*sock.getpeername()[:2])
        self._sock = sock
        self._loop = loop
        self._on_closed = on_closed
        self._outbox: deque[memoryview] = deque()
        self._begun = False
        self._drained = threading.Condition(threading.Lock())
        self._closed = False

    @property
    def waiting(self) -> int:
        """How many frames wait for the socket to take them."""
        return len(self._outbox)

    def open(self) -> None:
        """Start to watch for the peer's hanging up (on the loop)."""
        self._loop.add_reader(self._sock, self._readable)

    def send(self, frame: bytes) -> None:
        """Send ``frame``: at once, or after those that wait."""
        with self._drained:
            if self._closed:
                return
            self.sent += 1
            self.sent_bytes += len(frame)
            if self._outbox:
                if self.queue_size and len(self._outbox) - self._begun >= self.queue_size:
                    # The frame in front may be half on its way: that one has to stay.
                    del self._outbox[1 if self._begun else 0]
                    self.dropped += 1
                self._outbox.append(memoryview(frame))
            else:
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
                self._outbox.append(memoryview(frame)[count:])
                self._post(self._start_writing)

    def wait(self) -> None:
        """Return when the socket has taken all that waits, or the link is closed (not on the loop)."""
        with self._drained:
            self._drained.wait_for(lambda: not self._outbox or self._closed)

    async def drain(self, timeout: float) -> None:
        """The same on the loop, for at most ``timeout`` seconds."""
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

    def _post(self, function: Callable[[], None]) -> None:
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(function)

    def _start_writing(self) -> None:
        with self._drained:
            if self._closed or not self._outbox:
                return
        self._loop.add_writer(self._sock, self._writable)
        self._writable()

    def _writable(self) -> None:
        with self._drained:
            if self._closed:
                return
            try:
                self._write_some()
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                self._loop.call_soon(self.close)
                return
            if not self._outbox:
                self._loop.remove_writer(self._sock)
                self._drained.notify_all()

    def _write_some(self) -> None:
        outbox = self._outbox
        waiting = [outbox[i] for i in range(min(len(outbox), _GATHER))]
        # Windows has no sendmsg: there, several small frames are joined first.
        gather = getattr(self._sock, "sendmsg", None)
        count = gather(waiting) if gather else self._sock.send(b"".join(waiting))
        while count and outbox:
            first = outbox[0]
            if count < len(first):
                outbox[0] = first[count:]
                self._begun = True
                return
            count -= len(first)
            outbox.popleft()
            self._begun = False

    def _readable(self) -> None:
        """A subscriber sends nothing: what becomes readable is its end."""
        try:
            if self._sock.recv(4096):
                return
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            pass
        self.close()


def is_sending(frame: FrameType | None) -> bool:
    """Whether the stack at ``frame`` is inside :meth:`OutLink.send`, where a link's lock is held.

    A signal handler that finds its thread there must not send itself: it has to come back a moment later.
    """
    while frame is not None:
        if frame.f_code is OutLink.send.__code__:
            return True
        frame = frame.f_back
    return False


def read_frames(sock: socket.socket, deliver: Callable[[memoryview], None], newest: int = 0) -> None:
    """Read frames in the calling thread until the peer ends; closes the socket.

    ``newest``: of what lies ready when the thread comes to read, only so many frames, the newest, are
    delivered (0: all), so that a slow receiver sees the present. Raises OSError or WireError.
    """
    reader = FrameReader()
    try:
        sock.setblocking(True)
        receive = sock.recv_into
        while True:
            count = receive(reader.space())
            if not count:
                return
            if newest:
                _deliver_newest(sock, reader, count, deliver, newest)
            else:
                for frame in reader.received(count):
                    deliver(frame)
    finally:
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


def _deliver_newest(
    sock: socket.socket, reader: FrameReader, count: int, deliver: Callable[[memoryview], None], newest: int
) -> None:
    """Read on while something lies ready, then deliver the newest frames."""
    kept: deque[memoryview | bytes] = deque(maxlen=newest)
    total = 0
    while True:
        total += count
        # A small frame lies in the reader's buffer, which the next receive reuses.
        kept.extend(frame if len(frame) > 65536 else bytes(frame) for frame in reader.received(count))
        if total >= _DRAIN_BYTES or not _ready(sock):
            break
        count = sock.recv_into(reader.space())
        if not count:
            break
    for frame in kept:
        deliver(memoryview(frame))


def _ready(sock: socket.socket) -> bool:
    """Whether a read would not wait. poll, since select fails on descriptors above 1023."""
    if hasattr(select, "poll"):
        poll = select.poll()
        poll.register(sock, select.POLLIN)
        return bool(poll.poll(0))
    return bool(select.select([sock], [], [], 0)[0])


async def _receive_header(sock: socket.socket) -> Header:
    (length,) = struct.unpack("<I", await _receive_exactly(sock, 4))
    if length > MAX_HEADER:
        raise WireError(f"a connection header of {length} bytes is not TCPROS")
    return parse_header(await _receive_exactly(sock, length))


async def _receive_exactly(sock: socket.socket, count: int) -> bytes:
    loop = asyncio.get_running_loop()
    data = b""
    while len(data) < count:
        more = await loop.sock_recv(sock, count - len(data))
        if not more:
            raise WireError("the peer closed the connection during the handshake")
        data += more
    return data


@contextlib.contextmanager
def _time_limit(doing: str) -> Iterator[None]:
    """Turn asyncio's TimeoutError, which is no OSError before Python 3.11, into one that says what was done."""
    try:
        yield
    except asyncio.TimeoutError:
        raise OSError(f"timed out {doing}") from None
