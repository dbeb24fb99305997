"""Services at run time: the server's end runs a handler in a worker, the client's end blocks its caller.

Both work on bytes. Source: http://wiki.ros.org/ROS/TCPROS ("Services").
"""

from __future__ import annotations

import contextlib
import logging
import socket
import struct
import threading
from collections.abc import Callable, Mapping
from urllib.parse import urlsplit

from minirospy.errors import HandshakeRefused, ServiceException, WireError
from minirospy.runtime import tcp
from minirospy.runtime.workers import Workers
from minirospy.wire.framing import MAX_FRAME
from minirospy.wire.header import MAX_HEADER, Header, parse_header, serialize_header
from minirospy.wire.tcpros import (
    InterfaceType,
    check_service,
    check_service_client,
    service_client_header,
    service_header,
)

__all__ = ["Handler", "ServiceClient", "ServiceServer", "parse_service_uri"]

_log = logging.getLogger(__name__)
_ANSWER = struct.Struct("<BI")
_LENGTH = struct.Struct("<I")
_RECEIVE = 16 * 1024
_MOST = 1024 * 1024

Handler = Callable[[memoryview, Header], bytes]
"""Request bytes and the client's header in, response bytes out; raises ServiceException with the text to send."""


class ServiceServer:
    """A service that this node offers; each connection is served by a worker of its own."""

    def __init__(
        self,
        name: str,
        type_: InterfaceType,
        caller_id: str,
        handler: Handler,
        *,
        request_type: str,
        response_type: str,
        workers: Workers,
    ) -> None:
        self.name = name
        self.type = type_
        self._handler = handler
        self._answer = service_header(type_, caller_id, request_type, response_type)
        self._workers = workers
        self._lock = threading.Lock()
        self._open: set[socket.socket] = set()

    async def accept(self, sock: socket.socket, fields: Header) -> str | None:
        """Answer a client's header and serve it, or return why it is refused."""
        why = check_service_client(fields, self.type)
        if why:
            return why
        await tcp.send_header(sock, self._answer)
        if fields.get("probe") == "1":
            sock.close()
            return None
        tcp.tune(sock)
        with self._lock:
            self._open.add(sock)
        self._workers.start(self._serve, sock, fields)
        return None

    def close(self) -> None:
        """Hang up on every client: a call under way ends there with an error, not with a wait."""
        with self._lock:
            for sock in self._open:
                tcp.hang_up(sock)

    def _serve(self, sock: socket.socket, fields: Header) -> None:
        persistent = fields.get("persistent", "").lower() in ("1", "true")
        try:
            sock.setblocking(True)
            reader = _Reader(sock)
            while True:
                length = reader.take(4, at_end_ok=True)
                if not length:
                    return
                request = reader.take(_checked(_LENGTH.unpack(length)[0]))
                sock.sendall(self._respond(memoryview(request), fields))
                if not persistent:
                    return
        except (OSError, WireError) as error:
            _log.debug("service %s: client %s: %s", self.name, fields.get("callerid"), error)
        finally:
            with self._lock:
                self._open.discard(sock)
            sock.close()

    def _respond(self, request: memoryview, fields: Header) -> bytes:
        try:
            body = self._handler(request, fields)
        except ServiceException as error:
            text = str(error).encode()
            return _ANSWER.pack(0, len(text)) + text
        return _ANSWER.pack(1, len(body)) + body


class ServiceClient:
    """A connection to one service, used by one thread at a time; it blocks the thread that calls.

    ``timeout`` bounds connecting and the handshake; a call itself may take as long as its handler does,
    until :meth:`hang_up` ends it from another thread.
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
        timeout: float = tcp.HANDSHAKE_SECONDS,
    ) -> None:
        """Connect to ``uri`` (rosrpc://host:port) and exchange headers.

        Raises HandshakeRefused where the server says no, OSError or WireError where it cannot be talked to.
        """
        fields = service_client_header(
            service, md5sum, caller_id, persistent=persistent, probe=probe, extra=headers
        )
        self._sock = socket.create_connection(parse_service_uri(uri), timeout)
        try:
            tcp.tune(self._sock)
            self._sock.sendall(serialize_header(fields))
            self._reader = _Reader(self._sock)
            (length,) = _LENGTH.unpack(self._reader.take(4))
            if length > MAX_HEADER:
                raise WireError(f"{uri} does not speak TCPROS")
            self.header = parse_header(self._reader.take(length))
            check_service(self.header)
            self._sock.settimeout(None)
        except BaseException:
            self._sock.close()
            raise

    def call(self, request: bytes) -> bytes:
        """The response to ``request``. Raises HandshakeRefused with the handler's text, OSError, WireError."""
        self._sock.sendall(_LENGTH.pack(len(request)) + request)
        ok, length = _ANSWER.unpack(self._reader.take(_ANSWER.size))
        body = self._reader.take(_checked(length))
        if not ok:
            raise HandshakeRefused(body.decode("utf-8", "replace"))
        return body

    def hang_up(self) -> None:
        """End a call that is under way in another thread."""
        tcp.hang_up(self._sock)

    def close(self) -> None:
        """Close the connection. Idempotent."""
        with contextlib.suppress(OSError):
            self._sock.close()


def parse_service_uri(uri: str) -> tuple[str, int]:
    """(host, port) of ``rosrpc://host:port``. Raises WireError."""
    try:
        parts = urlsplit(uri)
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if parts.scheme != "rosrpc" or not host or not port:
        raise WireError(f"protocol uri is invalid: {uri}")
    return host, port


def _checked(length: int) -> int:
    if length > MAX_FRAME:
        raise WireError(f"a body of {length} bytes is over the limit of {MAX_FRAME}")
    return length


class _Reader:
    """Exact reads from a blocking socket; what came beyond them is kept for the next.

    A small request or answer arrives whole: so one receive takes length and body together.
    """

    def __init__(self, sock: socket.socket) -> None:
        self._receive = sock.recv
        self._rest = b""

    def take(self, count: int, *, at_end_ok: bool = False) -> bytes:
        """``count`` bytes; b"" where the peer ended before the first and that is in order. Raises WireError."""
        data = self._rest
        while len(data) < count:
            more = self._receive(min(max(count - len(data), _RECEIVE), _MOST))
            if not more:
                if at_end_ok and not data:
                    return b""
                raise WireError("the peer closed the connection in the middle")
            data = data + more if data else more
            if count > _MOST:
                return self._take_large(data, count)
        self._rest = data[count:]
        return data[:count]

    def _take_large(self, data: bytes, count: int) -> bytes:
        parts = [data]
        missing = count - len(data)
        while missing > 0:
            more = self._receive(min(missing, _MOST))
            if not more:
                raise WireError("the peer closed the connection in the middle")
            parts.append(more)
            missing -= len(more)
        whole = b"".join(parts)
        self._rest = whole[count:]
        return whole[:count]
