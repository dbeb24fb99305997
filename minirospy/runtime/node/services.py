"""Service servers, whose handlers run in a worker or on the loop, and a service client on the loop.

All of them work on bytes; the blocking client is in ``runtime/node/service_client.py``.
Source: http://wiki.ros.org/ROS/TCPROS ("Services").
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import threading
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass

from minirospy.base.errors import CallFailed, ServiceException, ThreadLimitError, WireError
from minirospy.core.wire.header import Header
from minirospy.core.wire.service import (
    REQUEST_HEAD,
    RESPONSE_HEAD,
    parse_request_head,
    parse_response_head,
    serialize_failure,
    serialize_request,
    serialize_response,
)
from minirospy.core.wire.tcpros import (
    InterfaceType,
    check_service,
    check_service_client,
    service_client_header,
    service_header,
)
from minirospy.runtime.node.service_client import PeerEndedError, Reader, parse_service_uri
from minirospy.runtime.transport import local, sockets, tcp
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger
from minirospy.runtime.transport.workers import Workers

__all__ = [
    "AsyncHandler",
    "AsyncServiceClient",
    "Handler",
    "LoopServiceServer",
    "ServiceServer",
]

_log = logging.getLogger(__name__)

Handler = Callable[[memoryview, Header], bytes]
"""A function that takes the request's bytes and the client's header, and returns the response's bytes. It may raise
ServiceException.

Any other exception is logged and sent as rospy sends it: ``error processing request: ...``. The connection stays open.
"""

# A coroutine function with Handler's parameters and result, called on the loop
AsyncHandler = Callable[[bytes, Header], Awaitable[bytes]]


class ServiceServer:
    """A service that this node offers; a separate worker serves each connection."""

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
        self._refusals = RateLimitedLogger(_log)
        self._handler = handler
        self._answer = service_header(name, type_, caller_id, request_type, response_type)
        self._workers = workers
        self._lock = threading.Lock()
        self._open: set[_Connection] = set()
        self._closed = False

    async def accept(self, sock: socket.socket, fields: Header) -> str | None:
        """Reply to a client's header and serve the client, or return the reason for refusing it."""
        why = check_service_client(fields, self.type)
        if why:
            return why

        await tcp.send_header(sock, self._answer)
        if fields.get("probe") == "1":
            sock.close()
            return None

        sockets.tune(sock)
        connection = _Connection(sock)
        with self._lock:
            self._open.add(connection)

        try:
            self._start(connection, fields)
        except ThreadLimitError as error:
            _log.error("service %s: a call is refused: %s", self.name, error)
            with self._lock:
                self._open.discard(connection)
            await self._refuse_call(sock, error)
        return None

    async def _refuse_call(self, sock: socket.socket, error: Exception) -> None:
        """Respond to a client's call with the reason for refusing it; the client's header has already been accepted."""
        try:
            head = await asyncio.wait_for(_receive(sock, REQUEST_HEAD), sockets.HANDSHAKE_SECONDS)
            length = parse_request_head(head)
            await asyncio.wait_for(_receive(sock, length), sockets.HANDSHAKE_SECONDS)
            await asyncio.get_running_loop().sock_sendall(sock, serialize_failure(error))
        except (OSError, WireError, asyncio.TimeoutError):
            _log.debug("service %s: a client that cannot be served has not called", self.name)
        finally:
            sock.close()

    def close(self) -> None:
        """Stop serving. Calls in progress still get their responses; all other clients are disconnected."""
        with self._lock:
            self._closed = True
            for connection in self._open:
                if not connection.busy:
                    sockets.hang_up(connection.sock)

    def _start(self, connection: _Connection, fields: Header) -> None:
        self._workers.start(self._serve, connection, fields)

    def _serve(self, connection: _Connection, fields: Header) -> None:
        persistent = _is_persistent(fields)
        sock = connection.sock
        try:
            sock.setblocking(True)
            reader = Reader(sock)
            while not self._closed:
                head = reader.read(REQUEST_HEAD, at_end_ok=True)
                if not head:
                    return

                connection.busy = True
                request = self._read_request(reader, parse_request_head(head))
                sock.sendall(self._respond(memoryview(request), fields))
                connection.busy = False
                if not persistent:
                    return
        except (OSError, WireError) as error:
            self._client_failed(error, fields)
        finally:
            with self._lock:
                self._open.discard(connection)
            sock.close()

    def _read_request(self, reader: Reader, size: int) -> bytes:
        try:
            return reader.read(size)
        except MemoryError:
            raise WireError(f"no memory for a request of {size} bytes") from None

    def _client_failed(self, error: OSError | WireError, fields: Header) -> None:
        """Log why a client was disconnected. If it disconnected by itself, log at level debug."""
        is_refused = isinstance(error, WireError) and not isinstance(error, PeerEndedError)
        log = self._refusals.warning if is_refused else _log.debug
        log("service %s: client %s is disconnected: %s", self.name, fields.get("callerid"), error)

    def _respond(self, request: memoryview, fields: Header) -> bytes:
        try:
            return serialize_response(self._handler(request, fields))
        except BaseException as error:  # noqa: BLE001 - the handler may raise anything; the client needs a response
            return self._failure(error)

    def _failure(self, error: BaseException) -> bytes:
        """Return the response to a call whose handler raised; log the exception unless it is a ServiceException."""
        if isinstance(error, ServiceException):
            return serialize_failure(error)

        _log.error("service %s: error processing request", self.name, exc_info=error)
        try:
            text = str(error)
        except Exception:  # noqa: BLE001 - str() of the handler's exception may raise, too
            text = type(error).__name__
        if not isinstance(error, Exception):
            # str(error) may be empty or just a number, so prepend the exception's type.
            text = f"{type(error).__name__}: {text}".removesuffix(": ")
        return serialize_failure(ServiceException(f"error processing request: {text}"))


class LoopServiceServer(ServiceServer):
    """A service whose handler is a coroutine function: a task on the loop serves each connection."""

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
        """Cancel the calls in progress."""
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
                head = await _receive(sock, REQUEST_HEAD)
                connection.busy = True
                request = await _receive(sock, parse_request_head(head))
                await loop.sock_sendall(sock, await self._respond_on_loop(sock, request, fields))
                connection.busy = False
                if not persistent:
                    return
        except (OSError, WireError) as error:
            self._client_failed(error, fields)
        finally:
            self._open.discard(connection)
            sock.close()

    async def _respond_on_loop(self, sock: socket.socket, request: bytes, fields: Header) -> bytes:
        try:
            return serialize_response(await self._async_handler(request, fields))
        except (Exception, SystemExit) as error:  # noqa: BLE001 - the handler may raise anything; the client needs a response
            # A task that raises SystemExit would end the asyncio loop, and with it everything that the node does.
            return self._failure(error)
        except asyncio.CancelledError:
            # Either this task or an operation that the handler awaited was cancelled.
            # Only Python 3.11 and later can tell the two apart.
            if not self._closed:
                _log.error("service %s: the handler of a call was cancelled", self.name)
                with contextlib.suppress(OSError):
                    sock.send(
                        serialize_failure(ServiceException("error processing request: it was cancelled"))
                    )
            raise


@dataclass(eq=False)
class _Connection:
    """One client of a service. ``busy`` is true from the first bytes of a request until its response has been sent."""

    sock: socket.socket
    busy: bool = False


class AsyncServiceClient:
    """An asyncio version of the client in ``service_client.py``. Created by :meth:`connect`; used by one task at a time."""

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
        timeout: float = sockets.HANDSHAKE_SECONDS,
        same_host: bool = True,
    ) -> AsyncServiceClient:
        """Connect to ``uri`` and exchange headers. Raise the same exceptions as :class:`ServiceClient`."""
        fields = service_client_header(
            service, md5sum, caller_id, persistent=persistent, probe=probe, extra=headers
        )
        address = parse_service_uri(uri)
        sock = (local.reach(*address) if same_host else None) or await tcp.connect(*address, timeout)

        try:
            sockets.tune(sock)
            await tcp.send_header(sock, fields)
            header = await tcp.receive_header(sock, timeout)
            check_service(header)
        except BaseException:
            sock.close()
            raise

        return cls(sock, header)

    async def call(self, request: bytes) -> bytes:
        """Return the response to ``request``.

        Raise CallFailed if the handler failed, OSError or WireError if communication fails.
        """
        await asyncio.get_running_loop().sock_sendall(self._sock, serialize_request(request))
        ok, length = parse_response_head(await _receive(self._sock, RESPONSE_HEAD))
        body = await _receive(self._sock, length)
        if not ok:
            raise CallFailed(body)
        return body

    def has_ended(self) -> bool:
        """Return whether the server has disconnected and would not read another request."""
        return sockets.is_readable(self._sock)

    def hang_up(self) -> None:
        """Abort a call in progress in another task."""
        sockets.hang_up(self._sock)

    def close(self) -> None:
        """Close the connection. Idempotent."""
        self._sock.close()


def _is_persistent(fields: Header) -> bool:
    return fields.get("persistent", "").lower() in ("1", "true")


def _never_called(_: memoryview, __: Header) -> bytes:
    raise AssertionError("a service on the loop has no worker")


async def _receive(sock: socket.socket, count: int) -> bytes:
    """Return exactly ``count`` bytes, on the loop. Raise WireError if the peer closes the connection before that."""
    loop = asyncio.get_running_loop()
    try:
        buffer = bytearray(count)
    except MemoryError:
        raise WireError(f"no memory for a body of {count} bytes") from None
    at = 0
    with memoryview(buffer) as view:
        while at < count:
            more = await loop.sock_recv_into(sock, view[at:])
            if not more:
                raise PeerEndedError(at)
            at += more
    return bytes(buffer)
