"""TCP sockets on the loop: listening, connecting, and the exact reads of a handshake.

A handshake reads exactly a header's bytes and nothing after them, so that the socket can be passed on to a worker or a
writer.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import socket
import sys
from collections.abc import Awaitable, Callable, Iterator, Sequence

from minirospy.base.errors import WireError
from minirospy.core.wire.framing import LENGTH_BYTES, parse_length
from minirospy.core.wire.header import MAX_HEADER, Header, parse_header, serialize_header
from minirospy.runtime.transport import sockets
from minirospy.runtime.transport.limits import explain, is_file_limit
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

__all__ = [
    "MAX_HANDSHAKES",
    "HeaderMemory",
    "Listener",
    "bind",
    "connect",
    "receive_header",
    "send_header",
]

# Maximum number of handshakes in progress. One more closes the oldest, because a genuine handshake takes only milliseconds
MAX_HANDSHAKES = 200

_AT_HAND = 8192
_SHORT_HEADER = 64 * 1024
# maximum total bytes of incomplete headers longer than _SHORT_HEADER, for all of a node's peers
_MAX_LONG_HEADERS = 16 * 1024 * 1024

_REFUSALS_LOGGED = 10
_log = logging.getLogger(__name__)


def bind(host: str, port: int = 0, ports: range | None = None) -> socket.socket:
    """Bind a socket to an address on this machine and return it. Port 0 means any free port, from ``ports`` if given.

    Raise OSError if it cannot be bound.
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


async def connect(host: str, port: int, timeout: float = sockets.HANDSHAKE_SECONDS) -> socket.socket:
    """Return a connected, non-blocking socket. Raise OSError if connecting fails or times out."""
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


class HeaderMemory:
    """The memory reserved for receiving long headers from many peers."""

    def __init__(self, most: int = _MAX_LONG_HEADERS) -> None:
        self.held = 0  # bytes reserved
        self._most = most

    def reserve(self, count: int) -> None:
        """Reserve memory until :meth:`free` is called. Raise WireError if the limit is exceeded."""
        if self.held + count > self._most:
            raise WireError("too many long connection headers are being received at the same time")
        self.held += count

    def free(self, count: int) -> None:
        """Release reserved memory."""
        self.held -= count


async def receive_header(
    sock: socket.socket, timeout: float = sockets.HANDSHAKE_SECONDS, *, memory: HeaderMemory | None = None
) -> Header:
    """Return the peer's connection header. Raise OSError if the connection fails, WireError if the header is invalid.

    With ``memory``, a long header is refused if the headers of other peers use up the memory.
    """
    at_hand = _header_at_hand(sock)
    if at_hand is not None:
        return at_hand
    with _time_limit("waiting for a connection header"):
        return await asyncio.wait_for(_receive_header(sock, memory or HeaderMemory()), timeout)


async def send_header(sock: socket.socket, fields: Header) -> None:
    """Send a connection header with these fields."""
    data = serialize_header(fields)
    try:
        # This does not block: the header is short, and the buffer of a new socket is empty.
        sent = sock.send(data)
    except (BlockingIOError, InterruptedError):
        sent = 0
    if sent < len(data):
        await asyncio.get_running_loop().sock_sendall(sock, data[sent:])


class Listener:
    """A listening TCP socket; each connection is passed to ``accept`` in a separate task.

    ``accept(socket, address)`` does the handshake. If it raises OSError or WireError, the error is logged and the
    connection closed. The number of unfinished handshakes is limited. ``allows(peer_address, own_address)`` returns
    whether a peer may connect.
    """

    def __init__(
        self,
        accept: Callable[[socket.socket, str], Awaitable[None]],
        allows: Callable[[str, str], bool] | None = None,
    ) -> None:
        self._accept = accept
        self._allows = allows
        self._sock: socket.socket | None = None
        # The peer's address for each handshake task, in the order of their start.
        self.handshakes: dict[asyncio.Task[None], str] = {}
        self._limited_log = RateLimitedLogger(_log, _REFUSALS_LOGGED)
        self.port = 0

    def open(self, host: str, port: int = 0, ports: range | None = None) -> None:
        """Listen on ``host``. Port 0 means any free port, from ``ports`` if given. Raise OSError if that fails."""
        sock = bind(host, port, ports)
        self.listen(sock)
        self.port = sock.getsockname()[1]

    def listen(self, sock: socket.socket) -> None:
        """Listen on a bound socket. Raise OSError if another socket listens on the port."""
        try:
            sock.listen(socket.SOMAXCONN)
        except BaseException:
            sock.close()
            raise
        self._sock = sock
        self._watch()

    async def close(self) -> None:
        """Stop listening, and cancel handshakes in progress. Idempotent."""
        if self._sock is not None:
            asyncio.get_running_loop().remove_reader(self._sock)
            self._sock.close()
            self._sock = None
        tasks = list(self.handshakes)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._limited_log.close()

    def log_refusal(self, line: str) -> None:
        """Log the reason for refusing a connection, with a rate limit."""
        self._limited_log.warning("%s", line)

    def _watch(self) -> None:
        if self._sock is not None:
            asyncio.get_running_loop().add_reader(self._sock, self._take_one, self._sock)

    def _take_one(self, sock: socket.socket) -> None:
        """Accept one connection.

        The loop calls this again for the next one, so that the accepted connection is served in between.
        """
        try:
            peer, address = sock.accept()
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            # No file descriptors are free, or the peer has already disconnected.
            # Accepting the next connection may succeed a moment later.
            self.log_refusal(f"a connection could not be accepted: {explain(error)}")
            if is_file_limit(error):
                self._end_oldest("this process has no file descriptor left")
            loop = asyncio.get_running_loop()
            loop.remove_reader(sock)
            loop.call_later(0.05, self._watch)
            return
        peer.setblocking(False)
        if self._allows and not self._allows(address[0], peer.getsockname()[0]):
            self.log_refusal(
                f"connection from {address[0]} refused: MINIROSPY_ALLOW does not name its network"
            )
            peer.close()
            return
        if len(self.handshakes) >= MAX_HANDSHAKES:
            self._end_oldest(f"it sent nothing, and {MAX_HANDSHAKES} others are waiting")
        # A peer connected by a Unix socket has no address.
        where = f"{address[0]}:{address[1]}" if isinstance(address, tuple) else "this machine"
        task = asyncio.ensure_future(self._handle(peer, where))
        self.handshakes[task] = where

        def done(finished: asyncio.Task[None]) -> None:
            self.handshakes.pop(finished, None)
            if finished.cancelled():
                # Close the socket here, because the task may be cancelled before its first step.
                peer.close()

        task.add_done_callback(done)

    async def _handle(self, peer: socket.socket, address: str) -> None:
        try:
            await self._accept(peer, address)
        except (_NothingSaidError, BrokenPipeError):
            # The peer is a port scanner, or a node that has exited in the meantime.
            _log.debug("connection from %s: it disconnected before it was answered", address)
            peer.close()
        except (OSError, WireError) as error:
            self.log_refusal(f"connection from {address} refused: {error}")
            peer.close()
        except Exception:  # noqa: BLE001 - one connection's fault must not end the others, nor stay unseen
            _log.exception("connection from %s closed: a fault in this node", address)
            peer.close()

    def _end_oldest(self, why: str) -> None:
        for task in list(self.handshakes)[:1]:
            task.cancel()
            self.log_refusal(f"connection from {self.handshakes.pop(task)} closed: {why}")


def _bind(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    sock = socket.socket(family, socket.SOCK_STREAM)
    try:
        sock.setblocking(False)
        if sys.platform != "win32":
            # Do not set this on Windows, where it would let two servers share a port.
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            # Accept IPv4 too, because peers without ROS_IPV6 use IPv4.
            sock.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        sock.bind((host, port))
    except BaseException:
        sock.close()
        raise
    return sock


async def _addresses(host: str, port: int) -> Sequence[tuple[int, tuple[str | int | bytes, ...]]]:
    """Return (family, address) for each of a host's addresses. An IP address or "localhost" needs no resolver.

    IPv4 addresses are first, because ROS 1 servers listen there, while many resolvers return IPv6 first. Raise OSError if
    the host cannot be resolved.
    """
    if host == "localhost":
        return [(socket.AF_INET, ("127.0.0.1", port)), (socket.AF_INET6, ("::1", port))]
    for family in (socket.AF_INET, socket.AF_INET6):
        with contextlib.suppress(OSError):
            socket.inet_pton(family, host)
            return [(family, (host, port))]
    try:
        name = sockets.resolvable(host)
        infos = await asyncio.get_running_loop().getaddrinfo(name, port, type=socket.SOCK_STREAM)
    except RuntimeError as error:
        # Python does not start threads during interpreter shutdown.
        raise OSError(f"the address of {host} was not looked for: {error}") from error
    return sorted(((info[0], info[4]) for info in infos), key=lambda found: found[0] != socket.AF_INET)


def _header_at_hand(sock: socket.socket) -> Header | None:
    """Return a header if it has already arrived completely, as most have, else None. This saves a task and a timer."""
    try:
        seen = sock.recv(_AT_HAND, socket.MSG_PEEK)
    except (BlockingIOError, InterruptedError):
        return None
    length = parse_length(seen)
    end = LENGTH_BYTES + length
    return parse_header(sock.recv(end)[LENGTH_BYTES:]) if 0 < length <= len(seen) - LENGTH_BYTES else None


class _NothingSaidError(WireError):
    """The peer connected and disconnected without sending anything."""


async def _receive_header(sock: socket.socket, memory: HeaderMemory) -> Header:
    length = parse_length(await _receive_exactly(sock, LENGTH_BYTES, memory, _NothingSaidError))
    if length > MAX_HEADER:
        raise WireError(f"a connection header of {length} bytes is not TCPROS")
    return parse_header(await _receive_exactly(sock, length, memory))


async def _receive_exactly(
    sock: socket.socket, count: int, memory: HeaderMemory, nothing: type[WireError] = WireError
) -> bytes:
    """Return ``count`` bytes. Raise ``nothing`` if the peer closes before the first byte, WireError if it closes later."""
    loop = asyncio.get_running_loop()
    data = bytearray()
    taken = 0
    try:
        while len(data) < count:
            more = await loop.sock_recv(sock, min(count - len(data), _SHORT_HEADER))
            if not more:
                raise (WireError if data else nothing)("the peer closed the connection during the handshake")
            data += more
            if len(data) > _SHORT_HEADER:
                memory.reserve(len(more))
                taken += len(more)
        return bytes(data)
    finally:
        memory.free(taken)


@contextlib.contextmanager
def _time_limit(doing: str) -> Iterator[None]:
    """Convert asyncio's TimeoutError into the built-in one, and name the operation in its message.

    Before Python 3.11 they are different classes.
    """
    try:
        yield
    except asyncio.TimeoutError:
        raise TimeoutError(f"timed out {doing}") from None
