"""An XML-RPC client on the event loop."""

from __future__ import annotations

import asyncio
import errno
import os
import re
import socket
from collections.abc import Callable
from typing import Any

from minirospy.errors import RpcProtocolError, RpcUnreachable
from minirospy.runtime import tcp
from minirospy.runtime.rpc_client import parse_http_uri
from minirospy.wire.http import HttpMessage, HttpReader, serialize_request
from minirospy.wire.xmlrpc import parse_response, serialize_call

__all__ = ["AsyncRpcClient"]

_RECEIVE = 65536
_KEEP_PER_SERVER = 2
_KEEP_AT_MOST = 100
_KEEP_SECONDS = 10.0

# 10035: what Windows says of a connection that is being made.
_UNDER_WAY = {0, errno.EINPROGRESS, errno.EWOULDBLOCK, 10035}

# Nearly all URIs of nodes; taking one apart by the rules costs as much as the call.
_USUAL_URI = re.compile(r"http://([A-Za-z0-9._-]+):([1-9][0-9]{0,3}|[1-5][0-9]{4})(/[A-Za-z0-9._/-]*)?")

_Address = tuple[str, int]


class AsyncRpcClient:
    """Calls methods of any server; a few connections to each are kept for a while and reused."""

    def __init__(self) -> None:
        # Of each server, in the order of their last use: sockets, and when that was.
        self._idle: dict[_Address, list[tuple[socket.socket, float]]] = {}
        self._sweep: asyncio.TimerHandle | None = None
        self._closed = False

    async def call(self, uri: str, method: str, *args: Any, timeout: float = 5.0) -> Any:
        """The value that ``method`` at ``uri`` answers, within ``timeout`` seconds.

        Raises RpcUnreachable, RpcFault, or RpcProtocolError.
        """
        return parse_response(await self.post(uri, serialize_call(method, args), timeout))

    async def post(self, uri: str, body: bytes, timeout: float) -> bytes:
        """The same for a call that is XML already, and its answer as XML."""
        host, port, path = _parts(uri)
        request = serialize_request(f"{host}:{port}", path, body)
        try:
            message = await self._exchange((host, port), request, timeout)
        except (TimeoutError, asyncio.TimeoutError) as error:
            raise RpcUnreachable(uri, f"timed out after {timeout:g} s") from error
        except (OSError, EOFError) as error:
            raise RpcUnreachable(uri, str(error) or "the connection was closed") from error
        if message.status != 200:
            raise RpcProtocolError(f"{uri} answered {message.start}")
        return message.body

    async def close(self) -> None:
        """Close the kept connections. Idempotent."""
        self._closed = True
        if self._sweep:
            self._sweep.cancel()
            self._sweep = None
        for kept in self._idle.values():
            for sock, _ in kept:
                sock.close()
        self._idle.clear()

    async def _exchange(self, address: _Address, request: bytes, timeout: float) -> HttpMessage:
        end = asyncio.get_running_loop().time() + timeout
        sock = self._kept(address)
        if sock:
            try:
                return await self._ask(sock, address, request, end)
            except (ConnectionError, EOFError):
                # The peer closed it meanwhile: once more on a new one.
                pass
        host, port = address
        literal = _literal(host)
        if literal:
            sock = socket.socket()
            sock.setblocking(False)
            try:
                return await self._ask(sock, address, request, end, (literal, port))
            except ConnectionRefusedError:
                if literal == host:
                    raise
        left = end - asyncio.get_running_loop().time()
        sock = await tcp.connect(host, port, left)
        return await self._ask(sock, address, request, end)

    async def _ask(
        self,
        sock: socket.socket,
        address: _Address,
        request: bytes,
        end: float,
        connect_to: _Address | None = None,
    ) -> HttpMessage:
        exchange = _Exchange(sock, request, end, connect_to)
        try:
            message = await exchange.done
        except BaseException:
            exchange.close()
            raise
        exchange.leave()
        if message.keep_alive and not self._closed:
            self._keep(sock, address)
        else:
            sock.close()
        return message

    def _kept(self, address: _Address) -> socket.socket | None:
        kept = self._idle.get(address)
        if not kept:
            return None
        sock, _ = kept.pop()
        if not kept:
            del self._idle[address]
        return sock

    def _keep(self, sock: socket.socket, address: _Address) -> None:
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


class _Exchange:
    """One request and its answer on one socket, which is connected first where ``connect_to`` says so.

    Plain callbacks: a coroutine and its tasks would cost a master, which calls thousands of nodes, more than
    all the rest of a call.
    """

    def __init__(self, sock: socket.socket, request: bytes, end: float, connect_to: _Address | None) -> None:
        self._loop = asyncio.get_running_loop()
        self._sock = sock
        # Numbers, since the loop makes a text of what it does not know yet.
        self._fd = sock.fileno()
        self._left = request
        self._reader = HttpReader()
        self._writing = self._reading = False
        self.done: asyncio.Future[HttpMessage] = self._loop.create_future()
        self._timer = self._loop.call_at(end, self._fail, TimeoutError("timed out"))
        try:
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if connect_to:
                number = sock.connect_ex(connect_to)
                if number not in _UNDER_WAY:
                    raise OSError(number, os.strerror(number))
            if connect_to and number:
                self._write_on(self._connected)
            else:
                self._send()
        except OSError as error:
            self._fail(error)

    def leave(self) -> None:
        """Let go of the socket. Idempotent."""
        self._timer.cancel()
        self._stop_writing()
        if self._reading:
            self._reading = False
            self._loop.remove_reader(self._fd)

    def close(self) -> None:
        """Give up. Idempotent."""
        if self._sock.fileno() >= 0:
            self.leave()
            self._sock.close()

    def _connected(self) -> None:
        self._stop_writing()
        number = self._sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if number:
            self._fail(OSError(number, os.strerror(number)))
        else:
            self._send()

    def _send(self) -> None:
        try:
            sent = self._sock.send(self._left)
        except (BlockingIOError, InterruptedError):
            sent = 0
        except OSError as error:
            self._fail(error)
            return
        self._left = self._left[sent:]
        if self._left:
            self._write_on(self._send)
        else:
            self._stop_writing()
            self._reading = True
            self._loop.add_reader(self._fd, self._receive)

    def _receive(self) -> None:
        try:
            data = self._sock.recv(_RECEIVE)
            if not data and self._reader.is_idle:
                raise EOFError("the connection was closed without an answer")
            messages = self._reader.feed(data)
        except (BlockingIOError, InterruptedError):
            return
        except (OSError, EOFError, RpcProtocolError) as error:
            self._fail(error)
            return
        if messages and not self.done.done():
            self.leave()
            self.done.set_result(messages[0])

    def _write_on(self, function: Callable[[], None]) -> None:
        if not self._writing:
            self._writing = True
            self._loop.add_writer(self._fd, function)

    def _stop_writing(self) -> None:
        if self._writing:
            self._writing = False
            self._loop.remove_writer(self._fd)

    def _fail(self, error: Exception) -> None:
        self.close()
        if not self.done.done():
            self.done.set_exception(error)


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
