"""An XML-RPC client on the event loop."""

from __future__ import annotations

import asyncio
import errno
import os
import re
import socket
from collections.abc import Callable
from typing import Any

from minirospy.errors import RpcError, RpcProtocolError, RpcUnreachable
from minirospy.runtime import local, tcp
from minirospy.runtime.rpc_client import parse_http_uri
from minirospy.wire.http import HttpMessage, HttpReader, serialize_request
from minirospy.wire.xmlrpc import parse_response, serialize_call

__all__ = ["AsyncRpcClient", "Call"]

_RECEIVE = 65536
_KEEP_PER_SERVER = 2
_KEEP_AT_MOST = 100
_KEEP_SECONDS = 10.0

# 10035: what Windows says of a connection that is being made.
_UNDER_WAY = {errno.EINPROGRESS, errno.EWOULDBLOCK, 10035}

# Nearly all URIs of nodes; taking one apart by the rules costs as much as the call.
_USUAL_URI = re.compile(r"http://([A-Za-z0-9._-]+):([1-9][0-9]{0,3}|[1-5][0-9]{4})(/[A-Za-z0-9._/-]*)?")

_Address = tuple[str, int]


class AsyncRpcClient:
    """Calls methods of any server; a few connections to each are kept for a while and reused."""

    def __init__(self, *, nearby: bool = True) -> None:
        """``nearby``: a Unix socket is tried first."""
        self.nearby = nearby
        # Of each server, in the order of their last use: sockets, and when that was.
        self._idle: dict[_Address, list[tuple[socket.socket, float]]] = {}
        self._sweep: asyncio.TimerHandle | None = None
        self.under_way: set[Call] = set()
        self.closed = False

    async def call(self, uri: str, method: str, *args: Any, timeout: float = 5.0) -> Any:
        """The value that ``method`` at ``uri`` answers, within ``timeout`` seconds.

        Raises RpcUnreachable, RpcFault, or RpcProtocolError.
        """
        return parse_response(await self.post(uri, serialize_call(method, args), timeout))

    async def post(self, uri: str, body: bytes, timeout: float) -> bytes:
        """The same for a call that is XML already, and its answer as XML."""
        answer: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()

        def done(found: bytes | RpcError) -> None:
            if answer.done():
                return
            if isinstance(found, bytes):
                answer.set_result(found)
            else:
                answer.set_exception(found)

        call = self.begin(uri, body, timeout, done)
        try:
            return await answer
        finally:
            call.cancel()

    def begin(self, uri: str, body: bytes, timeout: float, done: Callable[[bytes | RpcError], None]) -> Call:
        """The same without a coroutine, which costs a master as much as all the rest of a call.

        ``done`` is called on the loop, perhaps at once, with what :meth:`post` would return or raise.
        """
        call = Call(self, uri, body, timeout, done)
        call.start()
        return call

    async def close(self) -> None:
        """Close the kept connections, and give up what is under way. Idempotent."""
        self.closed = True
        if self._sweep:
            self._sweep.cancel()
            self._sweep = None
        for kept in self._idle.values():
            for sock, _ in kept:
                sock.close()
        self._idle.clear()
        for call in list(self.under_way):
            call.fail(EOFError("the client was closed"))

    def take(self, address: _Address) -> socket.socket | None:
        """A kept connection."""
        kept = self._idle.get(address)
        if not kept:
            return None
        sock, _ = kept.pop()
        if not kept:
            del self._idle[address]
        return sock

    def keep(self, sock: socket.socket, address: _Address) -> None:
        """Keep a connection for the next call."""
        if self.closed:
            sock.close()
            return
        kept = self._idle.pop(address, [])
        if len(kept) >= _KEEP_PER_SERVER:
            kept.pop(0)[0].close()
        loop = asyncio.get_running_loop()
        kept.append((sock, loop.time()))
        self._idle[address] = kept
        if len(self._idle) > _KEEP_AT_MOST:
            for oldest, _ in self._idle.pop(next(iter(self._idle))):
                oldest.close()
        if self._sweep is None:
            self._sweep = loop.call_later(_KEEP_SECONDS, self._close_idle)

    def _close_idle(self) -> None:
        """Close what was not used for a while: a peer that ended would leave its half of a connection here."""
        loop = asyncio.get_running_loop()
        end = loop.time() - _KEEP_SECONDS / 2
        for address, kept in list(self._idle.items()):
            for sock, used in kept:
                if used < end:
                    sock.close()
            kept[:] = [entry for entry in kept if entry[1] >= end]
            if not kept:
                del self._idle[address]
        self._sweep = loop.call_later(_KEEP_SECONDS, self._close_idle) if self._idle else None


class Call:
    """One call: its request and its answer, on a connection that was kept or on a new one.

    Plain callbacks: a coroutine and its tasks would cost a master, which calls thousands of nodes, more than
    all the rest of a call.
    """

    __slots__ = (
        "_address",
        "_client",
        "_connecting",
        "_done",
        "_fd",
        "_is_kept",
        "_left",
        "_loop",
        "_reader",
        "_reading",
        "_request",
        "_sock",
        "_timeout",
        "_timer",
        "_uri",
        "_writing",
    )

    def __init__(
        self,
        client: AsyncRpcClient,
        uri: str,
        body: bytes,
        timeout: float,
        done: Callable[[bytes | RpcError], None],
    ) -> None:
        self._client = client
        self._uri = uri
        self._timeout = timeout
        self._done: Callable[[bytes | RpcError], None] | None = done
        self._loop = asyncio.get_running_loop()
        self._address: _Address = ("", 0)
        self._request = body
        self._left = memoryview(body)
        self._reader = HttpReader()
        self._sock: socket.socket | None = None
        # A number, since the loop makes a text of what it does not know yet.
        self._fd = -1
        self._is_kept = self._writing = self._reading = False
        self._timer: asyncio.TimerHandle | None = None
        self._connecting: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin: once."""
        try:
            host, port, path = _parts(self._uri)
        except RpcUnreachable as error:
            self._finish(error)
            return
        self._address = (host, port)
        self._request = serialize_request(f"{host}:{port}", path, self._request)
        self._client.under_way.add(self)
        self._timer = self._loop.call_later(self._timeout, self.fail, TimeoutError("timed out"))
        sock = self._client.take(self._address)
        if sock:
            self._is_kept = True
            self._use(sock)
            self._send()
        else:
            self._connect()

    def cancel(self) -> None:
        """Give up, and say nothing. Idempotent."""
        if self._done:
            self._done = None
            self._end()

    def fail(self, error: Exception) -> None:
        """Give up, and say why. Idempotent."""
        if isinstance(error, TimeoutError | asyncio.TimeoutError):
            why = f"timed out after {self._timeout:g} s"
        else:
            why = str(error) or "the connection was closed"
        unreachable = RpcUnreachable(self._uri, why)
        unreachable.__cause__ = error
        self._finish(error if isinstance(error, RpcError) else unreachable)

    def _connect(self) -> None:
        """A new connection, at once where the host needs no looking up."""
        host, port = self._address
        near = local.reach(host, port) if self._client.nearby else None
        if near:
            self._use(near)
            self._send()
            return
        literal = _literal(host)
        if not literal:
            self._look_up()
            return
        try:
            sock = socket.socket()
        except OSError as error:
            # No file descriptor is left.
            self.fail(error)
            return
        sock.setblocking(False)
        self._use(sock)
        try:
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            number = sock.connect_ex((literal, port))
        except OSError as error:
            self._broken(error)
            return
        if not number:
            self._send()
        elif number in _UNDER_WAY:
            self._send_early()
        else:
            self._broken(OSError(number, os.strerror(number)))

    def _look_up(self) -> None:
        async def connect() -> None:
            try:
                sock = await tcp.connect(*self._address, self._timeout)
            except OSError as error:
                self.fail(error)
            else:
                self._use(sock)
                self._send()

        self._connecting = asyncio.ensure_future(connect())

    def _use(self, sock: socket.socket) -> None:
        self._sock = sock
        self._fd = sock.fileno()
        # A view: a Unix socket takes a large request in many pieces.
        self._left = memoryview(self._request)

    def _send_early(self) -> None:
        """A connection to this machine is made by now, although nobody has said so yet."""
        assert self._sock
        try:
            sent = self._sock.send(self._left)
        except ConnectionError as error:
            self._broken(error)
        except OSError:
            self._write_on(self._connected)
        else:
            self._sent(sent)

    def _connected(self) -> None:
        assert self._sock
        self._stop_writing()
        number = self._sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if number:
            self._broken(OSError(number, os.strerror(number)))
        else:
            self._send()

    def _send(self) -> None:
        assert self._sock
        try:
            sent = self._sock.send(self._left)
        except (BlockingIOError, InterruptedError):
            sent = 0
        except OSError as error:
            self._broken(error)
            return
        self._sent(sent)

    def _sent(self, count: int) -> None:
        self._left = self._left[count:]
        if self._left:
            self._write_on(self._send)
        else:
            self._stop_writing()
            self._reading = True
            self._loop.add_reader(self._fd, self._receive)

    def _receive(self) -> None:
        assert self._sock
        try:
            data = self._sock.recv(_RECEIVE)
            if not data and self._reader.is_idle:
                raise EOFError("the connection was closed without an answer")
            messages = self._reader.feed(data)
        except (BlockingIOError, InterruptedError):
            return
        except (OSError, EOFError, RpcProtocolError) as error:
            self._broken(error)
            return
        if messages:
            self._answered(messages[0])

    def _answered(self, message: HttpMessage) -> None:
        sock = self._sock
        assert sock
        if message.keep_alive:
            self._let_go()
            self._sock = None
            self._client.keep(sock, self._address)
        if message.status == 200:
            self._finish(message.body)
        else:
            self._finish(RpcProtocolError(f"{self._uri} answered {message.start}"))

    def _broken(self, error: Exception) -> None:
        """This connection does not do: perhaps another one does."""
        self._close()
        if self._is_kept and isinstance(error, ConnectionError | EOFError):
            # The peer closed it meanwhile: once more on a new one.
            self._is_kept = False
            self._reader = HttpReader()
            self._connect()
        elif isinstance(error, ConnectionRefusedError) and _literal(self._address[0]) != self._address[0]:
            # "localhost" may be served at its IPv6 address alone.
            self._look_up()
        else:
            self.fail(error)

    def _finish(self, found: bytes | RpcError) -> None:
        done, self._done = self._done, None
        if done:
            self._end()
            done(found)

    def _end(self) -> None:
        self._client.under_way.discard(self)
        if self._timer:
            self._timer.cancel()
        if self._connecting:
            self._connecting.cancel()
        self._close()

    def _close(self) -> None:
        if self._sock:
            self._let_go()
            self._sock.close()
            self._sock = None

    def _let_go(self) -> None:
        self._stop_writing()
        if self._reading:
            self._reading = False
            self._loop.remove_reader(self._fd)

    def _write_on(self, function: Callable[[], None]) -> None:
        if not self._writing:
            self._writing = True
            self._loop.add_writer(self._fd, function)

    def _stop_writing(self) -> None:
        if self._writing:
            self._writing = False
            self._loop.remove_writer(self._fd)


def _parts(uri: str) -> tuple[str, int, str]:
    """Host, port and path. Raises RpcUnreachable."""
    usual = _USUAL_URI.fullmatch(uri)
    return (usual[1], int(usual[2]), usual[3] or "/") if usual else parse_http_uri(uri)


def _literal(host: str) -> str:
    """The IPv4 address that ``host`` is, or surely has; else ""."""
    if host == "localhost":
        return "127.0.0.1"
    try:
        socket.inet_pton(socket.AF_INET, host)
    except OSError:
        return ""
    return host
