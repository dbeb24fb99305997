"""Services at run time: a server's handler runs in a worker, a client blocks its caller; and both on the loop.

All work on bytes. Source: http://wiki.ros.org/ROS/TCPROS ("Services").
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import select
import socket
import struct
import threading
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

from minirospy.errors import CallFailed, ServiceException, WireError
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

__all__ = [
    "AsyncHandler",
    "AsyncServiceClient",
    "Handler",
    "LoopServiceServer",
    "ServiceClient",
    "ServiceServer",
    "parse_service_uri",
]

_log = logging.getLogger(__name__)
_ANSWER = struct.Struct("<BI")
_LENGTH = struct.Struct("<I")
_RECEIVE = 16 * 1024
_MOST = 1024 * 1024

Handler = Callable[[memoryview, Header], bytes]
"""Request bytes and the client's header in, response bytes out; raises ServiceException with the text to send."""

AsyncHandler = Callable[[bytes, Header], Awaitable[bytes]]
"""The same as a coroutine function, on the loop."""


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
        self._answer = service_header(name, type_, caller_id, request_type, response_type)
        self._workers = workers
        self._lock = threading.Lock()
        self._open: set[_Connection] = set()
        self._closed = False

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
        connection = _Connection(sock)
        with self._lock:
            self._open.add(connection)
        self._start(connection, fields)
        return None

    def close(self) -> None:
        """Serve no more: clients that wait for an answer get it, the others are hung up on."""
        with self._lock:
            self._closed = True
            for connection in self._open:
                if not connection.busy:
                    tcp.hang_up(connection.sock)

    def _start(self, connection: _Connection, fields: Header) -> None:
        self._workers.start(self._serve, connection, fields)

    def _serve(self, connection: _Connection, fields: Header) -> None:
        persistent = _is_persistent(fields)
        sock = connection.sock
        try:
            sock.setblocking(True)
            reader = _Reader(sock)
            while not self._closed:
                length = reader.take(4, at_end_ok=True)
                if not length:
                    return
                connection.busy = True
                request = reader.take(_checked(_LENGTH.unpack(length)[0]))
                sock.sendall(self._respond(memoryview(request), fields))
                connection.busy = False
                if not persistent:
                    return
        except (OSError, WireError) as error:
            _log.debug("service %s: client %s: %s", self.name, fields.get("callerid"), error)
        finally:
            with self._lock:
                self._open.discard(connection)
            sock.close()

    def _respond(self, request: memoryview, fields: Header) -> bytes:
        try:
            body = self._handler(request, fields)
        except ServiceException as error:
            return _refusal(error)
        return _ANSWER.pack(1, len(body)) + body


class LoopServiceServer(ServiceServer):
    """A service whose handler is a coroutine function: each connection is served by a task on the loop."""

    def __init__(
        self,
        name: str,
        type_: InterfaceType,
        caller_id: str,
        handler: AsyncHandler,
        *,
        request_type: str,
        response_type: str,
        workers: Workers,
    ) -> None:
        super().__init__(
            name,
            type_,
            caller_id,
            _never_called,
            request_type=request_type,
            response_type=response_type,
            workers=workers,
        )
        self._async_handler = handler
        self._tasks: set[asyncio.Task[None]] = set()

    async def cancel(self) -> None:
        """End the calls that are under way."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _start(self, connection: _Connection, fields: Header) -> None:
        task = asyncio.ensure_future(self._serve_on_loop(connection, fields))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _serve_on_loop(self, connection: _Connection, fields: Header) -> None:
        sock, loop = connection.sock, asyncio.get_running_loop()
        persistent = _is_persistent(fields)
        try:
            while not self._closed:
                (length,) = _LENGTH.unpack(await _receive(sock, 4))
                connection.busy = True
                request = await _receive(sock, _checked(length))
                try:
                    body = await self._async_handler(request, fields)
                    answer = _ANSWER.pack(1, len(body)) + body
                except ServiceException as error:
                    answer = _refusal(error)
                await loop.sock_sendall(sock, answer)
                connection.busy = False
                if not persistent:
                    return
        except (OSError, WireError) as error:
            _log.debug("service %s: client %s: %s", self.name, fields.get("callerid"), error)
        finally:
            self._open.discard(connection)
            sock.close()


@dataclass(eq=False)
class _Connection:
    """One client of a service; ``busy`` from its request's first bytes until it has the answer."""

    sock: socket.socket
    busy: bool = False


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
            self.header = self._receive_header(uri)
            check_service(self.header)
            self._sock.settimeout(None)
            self._poll = select.poll() if hasattr(select, "poll") else None
            if self._poll:
                self._poll.register(self._sock, select.POLLIN)
        except BaseException:
            self._sock.close()
            raise

    def call(self, request: bytes) -> bytes:
        """The response to ``request``. Raises CallFailed where the handler failed, OSError, WireError."""
        self._sock.sendall(_LENGTH.pack(len(request)) + request)
        ok, length = _ANSWER.unpack(self._reader.take(_ANSWER.size))
        body = self._reader.take(_checked(length))
        if not ok:
            raise CallFailed(body)
        return body

    def has_ended(self) -> bool:
        """Whether the server has hung up: a request that is sent now would not be read."""
        # Nothing comes unasked: what can be read is the end. A poll object of its own, since each call looks.
        return bool(self._poll.poll(0)) if self._poll else tcp.is_readable(self._sock)

    def hang_up(self) -> None:
        """End a call that is under way in another thread."""
        tcp.hang_up(self._sock)

    def close(self) -> None:
        """Close the connection. Idempotent."""
        with contextlib.suppress(OSError):
            self._sock.close()

    def _receive_header(self, uri: str) -> Header:
        try:
            (length,) = _LENGTH.unpack(self._reader.take(4))
            if length > MAX_HEADER:
                raise WireError(f"{uri} does not speak TCPROS")
            return parse_header(self._reader.take(length))
        except _PeerEnded as error:
            raise WireError(
                "connection from sender terminated before handshake header received. "
                f"{error.received} bytes were received. Please check sender for additional details."
            ) from error


class AsyncServiceClient:
    """The same on the loop; made by :meth:`connect`, used by one task at a time."""

    def __init__(self, sock: socket.socket, header: Header) -> None:
        self.header = header
        self._sock = sock

    @classmethod
    async def connect(
        cls,
        uri: str,
        service: str,
        md5sum: str,
        caller_id: str,
        *,
        persistent: bool = False,
        probe: bool = False,
        headers: Mapping[str, str] | None = None,
        timeout: float = tcp.HANDSHAKE_SECONDS,
    ) -> AsyncServiceClient:
        """Connect to ``uri`` and exchange headers. Raises as :class:`ServiceClient` does."""
        fields = service_client_header(
            service, md5sum, caller_id, persistent=persistent, probe=probe, extra=headers
        )
        sock = await tcp.connect(*parse_service_uri(uri), timeout)
        try:
            tcp.tune(sock)
            await tcp.send_header(sock, fields)
            header = await tcp.receive_header(sock, timeout)
            check_service(header)
        except BaseException:
            sock.close()
            raise
        return cls(sock, header)

    async def call(self, request: bytes) -> bytes:
        """The response to ``request``. Raises CallFailed where the handler failed, OSError, WireError."""
        await asyncio.get_running_loop().sock_sendall(self._sock, _LENGTH.pack(len(request)) + request)
        ok, length = _ANSWER.unpack(await _receive(self._sock, _ANSWER.size))
        body = await _receive(self._sock, _checked(length))
        if not ok:
            raise CallFailed(body)
        return body

    def has_ended(self) -> bool:
        """Whether the server has hung up: a request that is sent now would not be read."""
        return tcp.is_readable(self._sock)

    def close(self) -> None:
        """Close the connection. Idempotent."""
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
    # "localhost" may name IPv6 first, where no server of ROS 1 listens.
    return ("127.0.0.1" if host == "localhost" else host), port


def _is_persistent(fields: Header) -> bool:
    return fields.get("persistent", "").lower() in ("1", "true")


def _refusal(error: ServiceException) -> bytes:
    text = str(error).encode()
    return _ANSWER.pack(0, len(text)) + text


def _never_called(_: memoryview, __: Header) -> bytes:
    raise AssertionError("a service on the loop has no worker")


async def _receive(sock: socket.socket, count: int) -> bytes:
    """Exactly ``count`` bytes, on the loop. Raises WireError where the peer ends before."""
    loop = asyncio.get_running_loop()
    buffer = bytearray(count)
    at = 0
    with memoryview(buffer) as view:
        while at < count:
            more = await loop.sock_recv_into(sock, view[at:])
            if not more:
                raise _PeerEnded(at)
            at += more
    return bytes(buffer)


def _checked(length: int) -> int:
    if length > MAX_FRAME:
        raise WireError(f"a body of {length} bytes is over the limit of {MAX_FRAME}")
    return length


class _PeerEnded(WireError):
    """The peer has ended in the middle, after ``received`` bytes of what was to be read."""

    def __init__(self, received: int) -> None:
        super().__init__(received)
        self.received = received

    def __str__(self) -> str:
        return "unable to receive data from sender, check sender's logs for details"


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
                raise _PeerEnded(len(data))
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
                raise _PeerEnded(count - missing)
            parts.append(more)
            missing -= len(more)
        whole = b"".join(parts)
        self._rest = whole[count:]
        return whole[:count]
