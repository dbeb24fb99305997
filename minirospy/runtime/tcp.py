"""Sockets: listening, connecting, and the exact reads of a handshake, on the loop; links that carry frames.

A handshake reads exactly a header's bytes, so nothing of what follows is ever taken with it, and the
socket can be handed to a worker or a writer as it is.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import select
import socket
import struct
import sys
import threading
from collections import deque
from collections.abc import Awaitable, Callable, Iterator, Sequence
from types import FrameType
from typing import Any, Protocol

from minirospy.errors import WireError
from minirospy.wire.framing import FrameReader
from minirospy.wire.header import MAX_HEADER, Header, parse_header, serialize_header

__all__ = [
    "HANDSHAKE_SECONDS",
    "MOST_HANDSHAKES",
    "Keeps",
    "Listener",
    "OutLink",
    "bind",
    "connect",
    "hang_up",
    "is_readable",
    "is_sending",
    "read_frames",
    "receive_header",
    "send_header",
    "tune",
    "watch_frames",
]

HANDSHAKE_SECONDS = 10.0
"""Others may never answer: each handshake ends after this."""

MOST_HANDSHAKES = 200
"""Handshakes under way at once: one more ends the oldest, since who means it is done in milliseconds."""

_GATHER = 64
_AT_HAND = 8192
_DRAIN_BYTES = 64 * 1024 * 1024
_REFUSALS_TOLD = 10
_REFUSALS_SECONDS = 10.0
_KEEPALIVE = {"TCP_KEEPIDLE": 20, "TCP_KEEPALIVE": 20, "TCP_KEEPINTVL": 10, "TCP_KEEPCNT": 3}
"""Seconds of silence, seconds between questions, questions. macOS calls the first TCP_KEEPALIVE."""

_log = logging.getLogger(__name__)


def tune(sock: socket.socket, *, nodelay: bool = True) -> None:
    """TCP_NODELAY as asked; keepalive, so that a peer that lost power is noticed within a minute."""
    if nodelay:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in _KEEPALIVE.items():
        if hasattr(socket, option):
            with contextlib.suppress(OSError):
                sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)


def hang_up(sock: socket.socket) -> None:
    """End a connection; a thread that is blocked in a read of it wakes up and closes it."""
    with contextlib.suppress(OSError):
        sock.shutdown(socket.SHUT_RDWR)


def bind(host: str, port: int = 0, ports: range | None = None) -> socket.socket:
    """A socket that is bound to an address of this machine; port 0 takes a free one, out of ``ports`` if given.

    Raises OSError.
    """
    if port or not ports:
        return _bind(host, port)
    for candidate in ports:
        try:
            return _bind(host, candidate)
        except OSError as error:
            if error.errno != errno.EADDRINUSE and getattr(error, "winerror", None) not in (10013, 10048):
                raise
    raise OSError(errno.EADDRINUSE, f"no port of MINIROSPY_PORTS={ports[0]}-{ports[-1]} is free")


async def connect(host: str, port: int, timeout: float = HANDSHAKE_SECONDS) -> socket.socket:
    """A connected, non-blocking socket. Raises OSError, also where the time is up."""
    loop = asyncio.get_running_loop()
    last: OSError = OSError(f"{host} has no address")
    with _time_limit(f"looking for the address of {host}"):
        found = await asyncio.wait_for(_addresses(host, port), timeout)
    for family, address in found:
        sock = socket.socket(family, socket.SOCK_STREAM)
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
    at_hand = _header_at_hand(sock)
    if at_hand is not None:
        return at_hand
    with _time_limit("waiting for a connection header"):
        return await asyncio.wait_for(_receive_header(sock), timeout)


async def send_header(sock: socket.socket, fields: Header) -> None:
    """Send a connection header."""
    await asyncio.get_running_loop().sock_sendall(sock, serialize_header(fields))


class Listener:
    """A listening TCP socket; each connection is handed to ``accept`` in a task of its own.

    ``accept(socket, address)`` does the handshake. What it raises, OSError or WireError, is logged, and the
    connection is closed. Of handshakes that do not come to an end only so many are kept. ``allows(peer's
    address, own address)`` says who may connect at all.
    """

    def __init__(
        self,
        accept: Callable[[socket.socket, str], Awaitable[None]],
        allows: Callable[[str, str], bool] | None = None,
    ) -> None:
        self._accept = accept
        self._allows = allows
        self._sock: socket.socket | None = None
        # In the order of their beginning, and who is at the other end.
        self._handshakes: dict[asyncio.Task[None], str] = {}
        self._refusals = _Refusals()
        self.tell_refusal = self._refusals.tell
        """Log the line that says why a connection was refused; a flood of them is summed up."""
        self.port = 0

    def open(self, host: str, port: int = 0, ports: range | None = None) -> None:
        """Listen on ``host``; port 0 takes a free one, out of ``ports`` if given. Raises OSError."""
        sock = bind(host, port, ports)
        try:
            sock.listen(socket.SOMAXCONN)
        except BaseException:
            sock.close()
            raise
        self._sock = sock
        self.port = sock.getsockname()[1]
        self._watch()

    async def close(self) -> None:
        """Stop listening, and end handshakes that are under way. Idempotent."""
        if self._sock is not None:
            asyncio.get_running_loop().remove_reader(self._sock)
            self._sock.close()
            self._sock = None
        tasks = list(self._handshakes)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._refusals.close()

    def _watch(self) -> None:
        if self._sock is not None:
            asyncio.get_running_loop().add_reader(self._sock, self._take_one, self._sock)

    def _take_one(self, sock: socket.socket) -> None:
        """Accept one connection; the loop comes back for the next, and so those inside get on meanwhile."""
        try:
            peer, address = sock.accept()
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            # Out of file descriptors, or the peer has gone already: the next one may do, a moment later.
            self._refusals.tell(f"a connection could not be accepted: {error}")
            if error.errno in (errno.EMFILE, errno.ENFILE):
                self._end_oldest("this process has no file descriptor left")
            loop = asyncio.get_running_loop()
            loop.remove_reader(sock)
            loop.call_later(0.05, self._watch)
            return
        peer.setblocking(False)
        if self._allows and not self._allows(address[0], peer.getsockname()[0]):
            self._refusals.tell(
                f"connection from {address[0]} refused: MINIROSPY_ALLOW does not name its network"
            )
            peer.close()
            return
        if len(self._handshakes) >= MOST_HANDSHAKES:
            self._end_oldest(f"it said nothing, and {MOST_HANDSHAKES} others are waiting")
        where = f"{address[0]}:{address[1]}"
        task = asyncio.ensure_future(self._handle(peer, where))
        self._handshakes[task] = where

        def done(finished: asyncio.Task[None]) -> None:
            self._handshakes.pop(finished, None)
            if finished.cancelled():
                # Perhaps before its first step.
                peer.close()

        task.add_done_callback(done)

    async def _handle(self, peer: socket.socket, address: str) -> None:
        try:
            await self._accept(peer, address)
        except _NothingSaidError:
            # A node that ended meanwhile, or somebody who looked whether the port is open.
            _log.debug("connection from %s: it hung up without a word", address)
            peer.close()
        except (OSError, WireError) as error:
            self._refusals.tell(f"connection from {address} refused: {error}")
            peer.close()
        except Exception:
            peer.close()
            raise

    def _end_oldest(self, why: str) -> None:
        for task in list(self._handshakes)[:1]:
            task.cancel()
            self._refusals.tell(f"connection from {self._handshakes.pop(task)} closed: {why}")


class _Refusals:
    """Log lines about connections that are refused; of a flood of them, the first and the number of the others."""

    def __init__(self) -> None:
        self._lines = 0
        self._end: asyncio.TimerHandle | None = None

    def tell(self, line: str) -> None:
        """Log ``line``, or count it."""
        if self._end is None:
            self._end = asyncio.get_running_loop().call_later(_REFUSALS_SECONDS, self.close)
        self._lines += 1
        if self._lines <= _REFUSALS_TOLD:
            _log.warning(line)

    def close(self) -> None:
        """Tell how many were not told."""
        if self._end is not None:
            self._end.cancel()
            self._end = None
        if self._lines > _REFUSALS_TOLD:
            _log.warning("%d more connections were refused", self._lines - _REFUSALS_TOLD)
        self._lines = 0


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
    def number(self) -> int:
        """What tells this link from the node's others: its file descriptor."""
        return self._sock.fileno()

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


class Keeps(Protocol):
    """Whoever knows how many frames a slow receiver is to get: a number that may change at any time."""

    newest: int


def read_frames(sock: socket.socket, deliver: Callable[[memoryview], None], keeps: Keeps) -> None:
    """Read frames in the calling thread until the peer ends; closes the socket.

    ``keeps.newest``: of what lies ready when the thread comes to read, only so many frames, the newest, are
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
            if keeps.newest:
                _deliver_newest(sock, reader, count, deliver, keeps.newest)
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
        if total >= _DRAIN_BYTES or not is_readable(sock):
            break
        count = sock.recv_into(reader.space())
        if not count:
            break
    for frame in kept:
        deliver(memoryview(frame))


def is_readable(sock: socket.socket) -> bool:
    """Whether a read would not wait. poll, since select fails on descriptors above 1023."""
    if hasattr(select, "poll"):
        poll = select.poll()
        poll.register(sock, select.POLLIN)
        return bool(poll.poll(0))
    return bool(select.select([sock], [], [], 0)[0])


def _bind(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    sock = socket.socket(family, socket.SOCK_STREAM)
    try:
        sock.setblocking(False)
        if sys.platform != "win32":
            # On Windows the option would let two servers share a port.
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            # Peers without ROS_IPV6 come by IPv4.
            sock.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        sock.bind((host, port))
    except BaseException:
        sock.close()
        raise
    return sock


async def _addresses(host: str, port: int) -> Sequence[tuple[int, Any]]:
    """(family, address) of a host; an address or "localhost" asks no resolver. Raises OSError.

    IPv4 comes first: there the servers of ROS 1 listen, and many resolvers name IPv6 first.
    """
    if host == "localhost":
        return [(socket.AF_INET, ("127.0.0.1", port)), (socket.AF_INET6, ("::1", port))]
    for family in (socket.AF_INET, socket.AF_INET6):
        with contextlib.suppress(OSError):
            socket.inet_pton(family, host)
            return [(family, (host, port))]
    try:
        infos = await asyncio.get_running_loop().getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except RuntimeError as error:
        # Python lets no thread begin once the program is ending.
        raise OSError(f"the address of {host} was not looked for: {error}") from error
    return sorted(((info[0], info[4]) for info in infos), key=lambda found: found[0] != socket.AF_INET)


def _header_at_hand(sock: socket.socket) -> Header | None:
    """A header that has come as a whole, as that of one who has just connected mostly has: no task, no timer."""
    try:
        seen = sock.recv(_AT_HAND, socket.MSG_PEEK)
    except (BlockingIOError, InterruptedError):
        return None
    end = 4 + int.from_bytes(seen[:4], "little")
    return parse_header(sock.recv(end)[4:]) if 4 < end <= len(seen) else None


class _NothingSaidError(WireError):
    """The peer connected and hung up."""


async def _receive_header(sock: socket.socket) -> Header:
    (length,) = struct.unpack("<I", await _receive_exactly(sock, 4, _NothingSaidError))
    if length > MAX_HEADER:
        raise WireError(f"a connection header of {length} bytes is not TCPROS")
    return parse_header(await _receive_exactly(sock, length))


async def _receive_exactly(sock: socket.socket, count: int, nothing: type[WireError] = WireError) -> bytes:
    """``count`` bytes. Raises WireError, or ``nothing`` where not one came."""
    loop = asyncio.get_running_loop()
    data = b""
    while len(data) < count:
        more = await loop.sock_recv(sock, count - len(data))
        if not more:
            raise (WireError if data else nothing)("the peer closed the connection during the handshake")
        data += more
    return data


@contextlib.contextmanager
def _time_limit(doing: str) -> Iterator[None]:
    """Turn asyncio's TimeoutError, which is no OSError before Python 3.11, into one that says what was done."""
    try:
        yield
    except asyncio.TimeoutError:
        raise OSError(f"timed out {doing}") from None
