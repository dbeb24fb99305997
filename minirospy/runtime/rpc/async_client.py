"""An XML-RPC client on the event loop."""

from __future__ import annotations

import asyncio
import errno
import os
import re
import socket
from collections.abc import Callable
from functools import partial
from typing import Any

from minirospy.base.errors import RpcError, RpcProtocolError, RpcTimeout, RpcUnreachable
from minirospy.core.wire.http import (
    MAX_BODY,
    Body,
    HttpMessage,
    HttpReader,
    serialize_request,
    serialize_request_head,
)
from minirospy.core.wire.xmlrpc import parse_response, serialize_call
from minirospy.runtime.rpc.client import parse_http_uri
from minirospy.runtime.transport import local, tcp
from minirospy.runtime.transport.deadlines import Deadlines
from minirospy.runtime.transport.limits import explain

__all__ = ["AsyncRpcClient", "Call"]

_RECEIVE = 65536
_LARGE = 65536
_KEEP_PER_SERVER = 8
_KEEP_AT_MOST = 100
KEEP_SECONDS = 10.0

# 10035 is WSAEWOULDBLOCK, which Windows reports while connecting.
_UNDER_WAY = {errno.EINPROGRESS, errno.EWOULDBLOCK, 10035}

# Matches nearly all node URIs, and saves a complete parse, which costs as much as the call
_USUAL_URI = re.compile(r"http://([A-Za-z0-9._-]+):([1-9][0-9]{0,3}|[1-5][0-9]{4})(/[A-Za-z0-9._/-]*)?")

_Address = tuple[str, int]


class AsyncRpcClient:
    """Calls methods on any server. A few connections to each server stay open for a while to be reused."""

    def __init__(self, *, same_host: bool = True, max_answer: int = MAX_BODY) -> None:
        """Create the client.

        ``same_host``: try a Unix socket first. ``max_answer``: maximum size of a response, in bytes.
        """
        self.same_host = same_host
        self.max_answer = max_answer
        # The idle connections to each server, least recently used first.
        self.idle: dict[_Address, list[_Connection]] = {}
        self._sweep: asyncio.TimerHandle | None = None
        self.under_way: Deadlines[Call] = Deadlines(Call.end_late)
        self.closed = False

    async def call(self, uri: str, method: str, *args: object, timeout: float = 5.0) -> Any:
        """Call ``method`` at ``uri`` and return the value in the response, within ``timeout`` seconds.

        Raise RpcUnreachable if the server does not respond, RpcFault if the call fails there, RpcProtocolError if the
        response is invalid.
        """
        answer: asyncio.Future[Body] = asyncio.get_running_loop().create_future()
        call = self.start(uri, serialize_call(method, args), timeout, partial(_settle, answer))
        try:
            return parse_response(await answer)
        finally:
            call.cancel()

    def start(
        self, uri: str, body: bytes | list[bytes], timeout: float, done: Callable[[Body | RpcError], None]
    ) -> Call:
        """Like :meth:`call`, but with callbacks: on a busy master a coroutine would double the cost.

        ``body`` is the call as XML, possibly in pieces. ``done`` is called on the loop, possibly immediately, with the
        response as XML, or with the exception that :meth:`call` would raise.
        """
        call = Call(self, uri, body, timeout, done)
        call.start()
        return call

    async def close(self) -> None:
        """Close the idle connections, and abort calls in progress. Idempotent."""
        self.closed = True
        if self._sweep:
            self._sweep.cancel()
            self._sweep = None
        for kept in self.idle.values():
            for connection in kept:
                connection.close()
        self.idle.clear()
        for call in list(self.under_way):
            call.fail(EOFError("the client was closed"))
        self.under_way.close()

    def acquire(self, address: _Address) -> _Connection | None:
        """Take an idle connection to the server at ``address``, or return None if there is none."""
        kept = self.idle.get(address)
        if not kept:
            return None
        connection = kept.pop()
        if not kept:
            del self.idle[address]
        return connection

    def keep(self, connection: _Connection) -> None:
        """Keep an idle connection, so that the next call can use it."""
        if self.closed:
            connection.close()
            return
        kept = self.idle.pop(connection.address, [])
        if len(kept) >= _KEEP_PER_SERVER:
            kept.pop(0).close()
        kept.append(connection)
        self.idle[connection.address] = kept
        if len(self.idle) > _KEEP_AT_MOST:
            for oldest in self.idle.pop(next(iter(self.idle))):
                oldest.close()
        loop = asyncio.get_running_loop()
        connection.used = loop.time()
        if self._sweep is None:
            self._sweep = loop.call_later(KEEP_SECONDS, self._close_idle)

    def drop(self, connection: _Connection) -> None:
        """Remove a closed connection from the idle ones."""
        connection.close()
        kept = self.idle[connection.address]
        kept.remove(connection)
        if not kept:
            del self.idle[connection.address]

    def _close_idle(self) -> None:
        """Close connections that have not been used for a while, because each one may occupy a thread of the server."""
        loop = asyncio.get_running_loop()
        end = loop.time() - KEEP_SECONDS / 2
        for connection in [each for kept in self.idle.values() for each in kept if each.used < end]:
            self.drop(connection)
        self._sweep = loop.call_later(KEEP_SECONDS, self._close_idle) if self.idle else None


class _Connection:
    """A connection to a server, for sequential calls; the loop watches the socket while it is open."""

    __slots__ = ("_client", "_fd", "_is_watched", "_loop", "address", "call", "reader", "sock", "used")

    def __init__(
        self, client: AsyncRpcClient, loop: asyncio.AbstractEventLoop, sock: socket.socket, address: _Address
    ) -> None:
        self._client = client
        self._loop = loop
        self.sock = sock
        self.address = address
        # Register the file descriptor instead of the socket: asyncio formats an unregistered socket as a string, which is slow.
        self._fd = sock.fileno()
        self.call: Call | None = None
        self.reader = HttpReader(client.max_answer)
        self.used = 0.0
        self._is_watched = False

    def watch(self) -> None:
        """Start reading. Idempotent."""
        if not self._is_watched:
            self._is_watched = True
            self._loop.add_reader(self._fd, self._readable)

    def write_on(self, function: Callable[[], None]) -> None:
        """Call ``function`` whenever the socket is writable."""
        self._loop.add_writer(self._fd, function)

    def stop_writing(self) -> None:
        """Stop calling the function that :meth:`write_on` registered."""
        self._loop.remove_writer(self._fd)

    def close(self) -> None:
        """Close the connection's socket."""
        if self._is_watched:
            self._loop.remove_reader(self._fd)
        self.sock.close()

    def _readable(self) -> None:
        call = self.call
        try:
            data = self.sock.recv(_RECEIVE)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            if call:
                call.broken(error)
            else:
                self._client.drop(self)
            return
        if call:
            call.received(data)
        else:
            # No call is in progress, so any readable event means end of file.
            self._client.drop(self)


class Call:
    """One call: its request and its response, on an idle connection or a new one.

    It uses plain callbacks: on a master, which calls thousands of nodes, a coroutine and its tasks would double the cost.
    """

    __slots__ = (
        "_address",
        "_client",
        "_connecting",
        "_connection",
        "_done",
        "_is_kept",
        "_left",
        "_loop",
        "_next",
        "_request",
        "_timeout",
        "_uri",
        "_writing",
    )

    def __init__(
        self,
        client: AsyncRpcClient,
        uri: str,
        body: bytes | list[bytes],
        timeout: float,
        done: Callable[[Body | RpcError], None],
    ) -> None:
        self._client = client
        self._uri = uri
        self._timeout = timeout
        self._done: Callable[[Body | RpcError], None] | None = done
        self._loop = asyncio.get_running_loop()
        self._address: _Address = ("", 0)

        self._request = [body] if isinstance(body, bytes) else body
        # The index of the next part of the request to send.
        self._next = 0
        self._left: bytes | memoryview = b""
        self._connection: _Connection | None = None
        self._is_kept = self._writing = False
        self._connecting: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Start the call. Call this once."""
        try:
            host, port, path = _parts(self._uri)
        except RpcUnreachable as error:
            self._finish(error)
            return

        self._address = (host, port)
        size = sum(map(len, self._request))
        if size < _LARGE:
            self._request = [serialize_request(f"{host}:{port}", path, b"".join(self._request))]
        else:
            # Do not copy the body: several calls may share it.
            self._request = [serialize_request_head(f"{host}:{port}", path, size), *self._request]

        client = self._client
        client.under_way.set(self, self._timeout)
        kept = client.acquire(self._address)
        if kept:
            self._is_kept = True
            self._use(kept)
            self._send()
        else:
            self._connect()

    def cancel(self) -> None:
        """Cancel the call without calling ``done``. Idempotent."""
        if self._done:
            self._done = None
            self._end()

    def end_late(self) -> None:
        """Fail the call because its time limit has expired."""
        self.fail(TimeoutError("timed out"))

    def fail(self, error: Exception) -> None:
        """Fail the call with an error. Idempotent."""
        if not isinstance(error, TimeoutError | asyncio.TimeoutError):
            unreachable = RpcUnreachable(self._uri, explain(error) or "the connection was closed")
        elif self._connection and not self._left:
            unreachable = RpcTimeout(self._uri, self._timeout)
        else:
            unreachable = RpcUnreachable(self._uri, f"timed out after {self._timeout:g} s")
        unreachable.__cause__ = error
        self._finish(error if isinstance(error, RpcError) else unreachable)

    def received(self, data: bytes) -> None:
        """Accept bytes of the response; b"" means end of file."""
        assert self._connection
        reader = self._connection.reader
        try:
            if not data and reader.is_idle:
                raise EOFError("the connection was closed without an answer")
            messages = reader.feed(data)
        except (EOFError, RpcProtocolError) as error:
            self.broken(error)
            return
        if messages:
            self._answered(messages[0], is_all=len(messages) == 1 and reader.is_idle)

    def broken(self, error: Exception) -> None:
        """Close this connection, and retry on a new one if that may help; otherwise fail the call."""
        self._close()
        if self._is_kept and isinstance(error, ConnectionError | EOFError):
            # The peer has closed this idle connection, so retry on a new one.
            self._is_kept = False
            self._connect()
        elif isinstance(error, ConnectionRefusedError) and _literal(self._address[0]) != self._address[0]:
            # The server may listen only on the IPv6 address of "localhost".
            self._look_up()
        else:
            self.fail(error)

    def _connect(self) -> None:
        """Open a new connection, immediately if the host needs no DNS look-up."""
        host, port = self._address
        unix = local.reach(host, port) if self._client.same_host else None
        if unix:
            self._use(self._connected_by(unix))
            self._send()
            return

        literal = _literal(host)
        if not literal:
            self._look_up()
            return

        try:
            sock = socket.socket()
        except OSError as error:
            # There are no free file descriptors.
            self.fail(error)
            return
        sock.setblocking(False)
        self._use(self._connected_by(sock))

        try:
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            number = sock.connect_ex((literal, port))
        except OSError as error:
            self.broken(error)
            return

        if not number:
            self._send()
        elif number in _UNDER_WAY:
            self._send_early()
        else:
            self.broken(OSError(number, os.strerror(number)))

    def _look_up(self) -> None:
        async def connect() -> None:
            try:
                sock = await tcp.connect(*self._address, self._timeout)
            except OSError as error:
                self.fail(error)
            else:
                if not self._done:
                    # Before Python 3.12, asyncio.wait_for may lose a cancellation that coincides with the connection.
                    sock.close()
                    return
                self._use(self._connected_by(sock))
                self._send()

        self._connecting = asyncio.ensure_future(connect())

    def _connected_by(self, sock: socket.socket) -> _Connection:
        return _Connection(self._client, self._loop, sock, self._address)

    def _use(self, connection: _Connection) -> None:
        self._connection = connection
        connection.call = self
        self._left = self._request[0]
        self._next = 1

    def _send_early(self) -> None:
        """Send now if the peer is on this machine: such a connection is open before the loop reports it."""
        assert self._connection
        try:
            sent = self._connection.sock.send(self._left)
        except ConnectionError as error:
            self.broken(error)
        except OSError:
            self._write_on(self._connected)
        else:
            self._sent(sent)

    def _connected(self) -> None:
        assert self._connection
        self._stop_writing()
        number = self._connection.sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if number:
            self.broken(OSError(number, os.strerror(number)))
        else:
            self._send()

    def _send(self) -> None:
        assert self._connection
        try:
            sent = self._connection.sock.send(self._left)
        except (BlockingIOError, InterruptedError):
            sent = 0
        except OSError as error:
            self.broken(error)
            return
        self._sent(sent)

    def _sent(self, count: int) -> None:
        assert self._connection
        if count < len(self._left):
            # Slice a view to avoid copying: a Unix socket accepts a large request in many pieces.
            self._left = memoryview(self._left)[count:]
            self._write_on(self._send)
        elif self._next < len(self._request):
            self._left = self._request[self._next]
            self._next += 1
            self._write_on(self._send)
        else:
            self._left = b""
            self._stop_writing()
            self._connection.watch()

    def _answered(self, message: HttpMessage, *, is_all: bool) -> None:
        connection = self._connection
        assert connection
        if message.keep_alive and is_all and not self._left:
            connection.call = self._connection = None
            self._client.keep(connection)
        if message.status == 200:
            self._finish(message.body)
        else:
            self._finish(RpcProtocolError(f"{self._uri} answered {message.start}"))

    def _finish(self, found: Body | RpcError) -> None:
        done, self._done = self._done, None
        if done:
            self._end()
            done(found)

    def _end(self) -> None:
        self._client.under_way.drop(self)
        if self._connecting:
            self._connecting.cancel()
        self._close()

    def _close(self) -> None:
        if self._connection:
            self._stop_writing()
            self._connection.close()
            self._connection = None

    def _write_on(self, function: Callable[[], None]) -> None:
        if not self._writing:
            self._writing = True
            assert self._connection
            self._connection.write_on(function)

    def _stop_writing(self) -> None:
        if self._writing:
            self._writing = False
            assert self._connection
            self._connection.stop_writing()


def _settle(answer: asyncio.Future[Body], found: Body | RpcError) -> None:
    if answer.done():
        return
    if isinstance(found, RpcError):
        answer.set_exception(found)
    else:
        answer.set_result(found)


def _parts(uri: str) -> tuple[str, int, str]:
    """Split a URI into host, port and path. Raise RpcUnreachable if it is invalid."""
    usual = _USUAL_URI.fullmatch(uri)
    return (usual[1], int(usual[2]), usual[3] or "/") if usual else parse_http_uri(uri)


def _literal(host: str) -> str:
    """Return ``host`` if it is an IPv4 address, the IPv4 address that it is known to resolve to, or ""."""
    if host == "localhost":
        return "127.0.0.1"
    try:
        socket.inet_pton(socket.AF_INET, host)
    except OSError:
        return ""
    return host
