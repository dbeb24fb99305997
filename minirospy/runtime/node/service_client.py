"""A blocking service client, and exact reads from a socket.

This module does not import asyncio, which would delay a command that calls one service.
Source: http://wiki.ros.org/ROS/TCPROS ("Services").
"""

from __future__ import annotations

import contextlib
import select
import socket
from collections.abc import Mapping
from typing import Any

from minirospy.base.environment import split_uri
from minirospy.base.errors import CallFailed, WireError
from minirospy.core.wire.framing import LENGTH_BYTES, parse_length
from minirospy.core.wire.header import MAX_HEADER, Header, parse_header, serialize_header
from minirospy.core.wire.service import RESPONSE_HEAD, parse_response_head, serialize_request
from minirospy.core.wire.tcpros import check_service, service_client_header
from minirospy.runtime.transport import local, sockets

__all__ = ["PeerEndedError", "Reader", "ServiceClient", "parse_service_uri"]

_RECEIVE = 16 * 1024
_MOST = 1024 * 1024
_WAIT_ALL: int = getattr(socket, "MSG_WAITALL", 0)


class ServiceClient:
    """A connection to one service, used by one thread at a time; calls block that thread.

    ``timeout`` bounds connecting and the handshake. A call may take as long as the service's handler; another thread
    can abort it with :meth:`hang_up`.
    """

    def __init__(
        self,
        uri: str,
        service: str,
        md5sum: str,
        caller_id: str,
        *,
        persistent: bool = False,
        probe: bool = False,
        headers: Mapping[str, str] | None = None,
        timeout: float = sockets.HANDSHAKE_SECONDS,
        waits: bool = True,
        same_host: bool = True,
    ) -> None:
        """Connect to ``uri`` (rosrpc://host:port) and exchange headers. With ``same_host`` use a Unix socket if possible.

        With ``waits`` false, the caller can do something else before it calls :meth:`finish` to receive the server's header.
        Raise HandshakeRefused if the server refuses, OSError or WireError if communication fails.
        """
        self.header: Header = {}
        self._is_asked = False
        self.uri = uri
        fields = service_client_header(
            service, md5sum, caller_id, persistent=persistent, probe=probe, extra=headers
        )
        # Serialize before connecting: the server then finds the header on its first read from the connection.
        header = serialize_header(fields)
        self._sock = _connected(parse_service_uri(uri), timeout, same_host=same_host)

        try:
            self._sock.sendall(header)
            self._reader = Reader(self._sock)
            self._poll = select.poll() if hasattr(select, "poll") else None
            if self._poll:
                self._poll.register(self._sock, select.POLLIN)
        except BaseException:
            self._sock.close()
            raise

        if waits:
            self.finish()

    def finish(self, request: bytes | None = None) -> None:
        """Receive the server's header. On an error, close the connection and raise the same exceptions as the constructor.

        The ``request`` of the following :meth:`call` is sent first if the server is known to accept that, so that both
        responses need only one wait. If the server sends no header, it has not started to process the request.
        """
        try:
            # Only do this on a Unix socket, which only minirospy uses: rospy may lose data that arrives together with a header.
            if request is not None and len(request) < _RECEIVE and self._sock.family not in sockets.FAMILIES:
                self._send(request)
                self._is_asked = True
            self.header = self._receive_header()
            check_service(self.header)
            self._sock.settimeout(None)
        except BaseException:
            self._sock.close()
            raise

    def call(self, request: bytes) -> bytes:
        """Return the response to ``request``.

        Raise CallFailed if the handler failed, OSError or WireError if communication fails.
        """
        if self._is_asked:
            self._is_asked = False
        else:
            self._send(request)
        if not self._reader.rest:
            sockets.busy_poll(self._sock)

        ok, length = parse_response_head(self._reader.read(RESPONSE_HEAD))
        body = self._reader.read(length)
        if not ok:
            raise CallFailed(body)
        return body

    def has_ended(self) -> bool:
        """Return whether the server has disconnected and would not read another request."""
        # A server sends data only in response to requests, so a readable socket means end of file.
        # Reuse the poll object, because each call does this check.
        return bool(self._poll.poll(0)) if self._poll else sockets.is_readable(self._sock)

    def hang_up(self) -> None:
        """Abort a call in progress in another thread."""
        sockets.hang_up(self._sock)

    def detach(self) -> socket.socket:
        """Return the open socket; the caller now owns it."""
        return self._sock

    def close(self) -> None:
        """Close the connection. Idempotent."""
        with contextlib.suppress(OSError):
            self._sock.close()

    def _send(self, request: bytes) -> None:
        self._sock.sendall(serialize_request(request))

    def _receive_header(self) -> Header:
        sockets.busy_poll(self._sock)
        try:
            length = parse_length(self._reader.read(LENGTH_BYTES))
            if length > MAX_HEADER:
                raise WireError(f"{self.uri} does not speak TCPROS")
            return parse_header(self._reader.read(length))
        except PeerEndedError as error:
            raise WireError(
                "connection from sender terminated before handshake header received. "
                f"{error.received} bytes were received. Please check sender for additional details."
            ) from error


def parse_service_uri(uri: str) -> tuple[str, int]:
    """Parse ``rosrpc://host:port`` into (host, port). Raise WireError if the URI is invalid."""
    try:
        host, port, _ = split_uri(uri, "rosrpc")
    except ValueError:
        raise WireError(f"protocol uri is invalid: {uri}") from None
    # "localhost" may resolve to an IPv6 address first, on which no ROS 1 server listens.
    return ("127.0.0.1" if host == "localhost" else host), port


class PeerEndedError(WireError):
    """Raised if the peer closed the connection in the middle of the expected data, after ``received`` bytes."""

    def __init__(self, received: int) -> None:
        super().__init__(received)
        self.received = received

    def __str__(self) -> str:
        return "unable to receive data from sender, check sender's logs for details"


class Reader:
    """Reads exact numbers of bytes from a blocking socket; buffers surplus bytes for the next read.

    A small request or response arrives whole, so a single receive returns both its length and its body.
    """

    def __init__(self, sock: socket.socket) -> None:
        self._receive = sock.recv
        self.rest = b""  # bytes received, but not yet returned by read()

    def read(self, count: int, *, at_end_ok: bool = False) -> bytes:
        """Return ``count`` bytes, or b"" if ``at_end_ok`` and the peer closed before the first byte.

        Raise WireError if the peer closes too early.
        """
        data = self.rest
        while len(data) < count:
            more = self._some(max(count - len(data), _RECEIVE))
            if not more:
                if at_end_ok and not data:
                    return b""
                raise PeerEndedError(len(data))
            data = data + more if data else more
            if count > _RECEIVE:
                return self._take_large(data, count)
        self.rest = data[count:]
        return data[:count]

    def _some(self, count: int, flags: int = 0) -> bytes:
        """Receive and return up to ``count`` bytes, or b"" if the peer has closed."""
        try:
            return self._receive(min(count, _MOST), flags)
        except ConnectionResetError:
            # The peer closed the connection with unread data, which also counts as end of file.
            return b""

    def _take_large(self, data: bytes, count: int) -> bytes:
        parts = [data]
        missing = count - len(data)
        while missing > 0:
            more = self._some(missing, _WAIT_ALL)
            if not more:
                raise PeerEndedError(count - missing)
            parts.append(more)
            missing -= len(more)
        whole = b"".join(parts)
        self.rest = whole[count:]
        return whole[:count]


def _connected(address: tuple[str, int], timeout: float, *, same_host: bool) -> socket.socket:
    """Return a connected and tuned blocking socket. Raise OSError if connecting fails."""
    unix = local.reach(*address) if same_host else None
    if unix:
        unix.settimeout(timeout)
        return unix

    try:
        socket.inet_pton(socket.AF_INET, address[0])
    except OSError:
        named: Any = (sockets.resolvable(address[0]), address[1])
        sock = socket.create_connection(named, timeout)
        sockets.tune(sock)
        return sock

    # If the URI contains an IP address, as most service URIs do, no resolver is needed.
    sock = socket.socket()
    try:
        sockets.tune(sock)
        sock.settimeout(timeout)
        sock.connect(address)
    except BaseException:
        sock.close()
        raise
    return sock
