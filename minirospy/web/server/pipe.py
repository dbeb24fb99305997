"""A socket on the event loop: calls a callback with received bytes, and sends pieces without joining them.

``PlainPipe`` passes the pieces to the kernel unchanged (``sendmsg``), so that an image is not copied for each client;
``TlsPipe`` lets asyncio encrypt them.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import ssl
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from minirospy.web.server.queue import Piece

__all__ = ["LARGE_READ", "SMALL_READ", "Endpoints", "Pipe", "PipeEvents", "PlainPipe", "TlsPipe"]

# bytes per receive: small enough to serve 250 sending clients in one loop iteration
SMALL_READ = 64 * 1024
LARGE_READ = 256 * 1024  # bytes per receive for a large message while no other client waits
_MAX_PIECES = 128
"""Maximum number of pieces per sendmsg call; systems accept at most 1024."""


class Endpoints(NamedTuple):
    """The peer's port, and the local address and port. Empty if the connection is closed or is not TCP."""

    peer_port: int = 0
    address: str = ""
    port: int = 0


class PipeEvents(Protocol):
    """The callbacks for a pipe, which are called on the loop."""

    def received(self, data: bytes) -> None:
        """Process received bytes."""

    def writable(self) -> None:
        """Write more, because the kernel has accepted all written data."""

    def ended(self) -> None:
        """Release all resources, because the connection is closed. Called once."""


class Pipe(Protocol):
    """A connection. ``is_full``: whether the kernel has not accepted all data; ``copies``: whether unsent data is a copy.

    ``read_bytes``: the maximum number of bytes per receive, if it can be chosen.
    """

    read_bytes: int

    @property
    def is_full(self) -> bool: ...

    @property
    def unsent(self) -> int: ...

    @property
    def copies(self) -> bool: ...

    @property
    def endpoints(self) -> Endpoints: ...

    def write(self, pieces: Sequence[Piece]) -> None: ...

    def pause(self) -> None: ...

    def resume(self) -> None: ...

    def close(self, *, flush: bool = True) -> None: ...


class PlainPipe:
    """An unencrypted TCP connection."""

    copies = False

    def __init__(self, sock: socket.socket, loop: asyncio.AbstractEventLoop, events: PipeEvents) -> None:
        self.read_bytes = SMALL_READ
        self._sock = sock
        self._loop = loop
        self._events = events
        self._rest: list[memoryview] = []
        self._is_reading = False
        self._is_closing = False
        self._is_closed = False

    @property
    def is_full(self) -> bool:
        """Return whether the kernel has not accepted all written data."""
        return bool(self._rest)

    @property
    def unsent(self) -> int:
        """Number of bytes that the kernel has not accepted yet."""
        return sum(map(len, self._rest))

    @property
    def endpoints(self) -> Endpoints:
        """The port of the peer, and the local address and port."""
        return _endpoints(self._sock)

    def write(self, pieces: Sequence[Piece]) -> None:
        """Send pieces; buffer the data that the kernel does not accept."""
        if self._is_closing:
            return
        was_full = bool(self._rest)
        self._rest += [memoryview(piece) for piece in pieces if len(piece)]
        if not was_full:
            self._flush()
            if self._rest and not self._is_closed:
                self._loop.add_writer(self._sock, self._writable)

    def pause(self) -> None:
        """Stop reading."""
        if self._is_reading:
            self._is_reading = False
            self._loop.remove_reader(self._sock)

    def resume(self) -> None:
        """Start or continue reading."""
        if not self._is_reading and not self._is_closing:
            self._is_reading = True
            self._loop.add_reader(self._sock, self._readable)

    def close(self, *, flush: bool = True) -> None:
        """Close the connection; with ``flush``, send the written data first. Idempotent."""
        self._is_closing = True
        if not flush or not self._rest:
            self._end()

    def _readable(self) -> None:
        try:
            data = self._sock.recv(self.read_bytes)
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            data = b""
        if not data:
            self._end()
            return
        self._events.received(data)

    def _writable(self) -> None:
        self._flush()
        if self._is_closed or self._rest:
            return
        self._loop.remove_writer(self._sock)
        if self._is_closing:
            self._end()
        else:
            self._events.writable()

    def _flush(self) -> None:
        try:
            while self._rest:
                sent = _send(self._sock, self._rest[:_MAX_PIECES])
                done = 0
                while done < len(self._rest) and sent >= len(self._rest[done]):
                    sent -= len(self._rest[done])
                    done += 1
                del self._rest[:done]
                if sent:
                    self._rest[0] = self._rest[0][sent:]
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            self._end()

    def _end(self) -> None:
        if self._is_closed:
            return
        self._is_closing = self._is_closed = True
        self._rest.clear()
        self._loop.remove_reader(self._sock)
        self._loop.remove_writer(self._sock)
        with contextlib.suppress(OSError):
            # Shut down first: closing a socket with unread data resets the connection, which may lose data for the peer.
            self._sock.shutdown(socket.SHUT_WR)
        self._sock.close()
        self._events.ended()


def _endpoints(sock: socket.socket) -> Endpoints:
    if sock.family not in (socket.AF_INET, socket.AF_INET6):
        return Endpoints()
    try:
        return Endpoints(sock.getpeername()[1], *sock.getsockname()[:2])
    except OSError:  # the peer has disconnected
        return Endpoints()


def _send(sock: socket.socket, pieces: list[memoryview]) -> int:
    if hasattr(sock, "sendmsg"):
        return sock.sendmsg(pieces)
    return sock.send(pieces[0])  # Windows has no sendmsg


class TlsPipe(asyncio.Protocol):
    """An encrypted connection."""

    copies = True

    def __init__(self, connected: Callable[[TlsPipe, str], PipeEvents | None]) -> None:
        """Create a connection. ``connected(pipe, peer_address)`` returns an object to receive its events.

        To refuse the connection, ``connected`` writes a response and returns None.
        """
        self._connected = connected
        self.read_bytes = LARGE_READ  # the size that asyncio uses
        self._events: PipeEvents | None = None
        self._transport: asyncio.Transport | None = None
        self._is_paused = False

    @property
    def is_full(self) -> bool:
        """Return whether the buffered data exceeds asyncio's high-water mark."""
        return self._is_paused

    @property
    def unsent(self) -> int:
        """Number of bytes that the kernel has not accepted yet."""
        return self._transport.get_write_buffer_size() if self._transport else 0

    @property
    def endpoints(self) -> Endpoints:
        """The port of the peer, and the local address and port."""
        return _endpoints(self._transport.get_extra_info("socket")) if self._transport else Endpoints()

    def write(self, pieces: Sequence[Piece]) -> None:
        """Send pieces; asyncio buffers them if necessary."""
        if self._transport and not self._transport.is_closing():
            self._transport.writelines(pieces)

    def pause(self) -> None:
        """Stop reading."""
        if self._transport and self._transport.is_reading():
            self._transport.pause_reading()

    def resume(self) -> None:
        """Start or continue reading."""
        if self._transport and not self._transport.is_closing() and not self._transport.is_reading():
            self._transport.resume_reading()

    def close(self, *, flush: bool = True) -> None:
        """Close the connection. Idempotent."""
        if self._transport:
            if flush:
                self._transport.close()
            else:
                self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """See asyncio.Protocol. Starts the connection."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        peer = transport.get_extra_info("peername") or ("?",)
        self._events = self._connected(self, str(peer[0]))
        if self._events is None:
            transport.close()

    def data_received(self, data: bytes) -> None:
        """Forward received bytes."""
        if self._events:
            self._events.received(data)

    def pause_writing(self) -> None:
        """Record that asyncio's buffer is full, so that no more is written."""
        self._is_paused = True

    def resume_writing(self) -> None:
        """Continue to write, because asyncio's buffer has room again."""
        self._is_paused = False
        if self._events:
            self._events.writable()

    def connection_lost(self, exc: Exception | None) -> None:
        """Report that the connection has closed."""
        events, self._events, self._transport = self._events, None, None
        if events:
            events.ended()


def tls_context(certificate: str, key: str) -> ssl.SSLContext:
    """Return the TLS context of a server, given the PEM files of its certificate and key.

    Raise OSError or ssl.SSLError if they cannot be loaded.
    """
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.load_cert_chain(certificate, key or None)
    return context
