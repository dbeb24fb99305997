"""An XML-RPC server on the event loop."""

from __future__ import annotations

import asyncio
import errno
import logging
import sys
from collections.abc import Awaitable, Callable, Sequence
from typing import Any

from minirospy.errors import RpcFault, RpcProtocolError
from minirospy.wire.http import HttpMessage, HttpReader, serialize_error, serialize_response
from minirospy.wire.xmlrpc import parse_call, serialize_fault
from minirospy.wire.xmlrpc import serialize_response as serialize_value

__all__ = ["Dispatch", "RpcServer", "is_address_in_use"]

_log = logging.getLogger(__name__)

_REQUEST_SECONDS = 30.0
"""A request that has begun must be whole after this."""

Dispatch = Callable[[str, Sequence[Any]], Any]
"""Method name and arguments in, value out, or an awaitable of it; raises RpcFault."""


class RpcServer:
    """Serves ``dispatch`` over HTTP at any path, with keep-alive and pipelining."""

    def __init__(self, dispatch: Dispatch, *, bind_host: str = "127.0.0.1", port: int = 0) -> None:
        self._dispatch = dispatch
        self._bind_host = bind_host
        self.port = port
        self._server: asyncio.Server | None = None
        self._connections: set[_Connection] = set()

    async def start(self) -> None:
        """Listen; with port 0 ``port`` tells the one that was free. Raises OSError."""
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(
            lambda: _Connection(self._dispatch, self._connections),
            self._bind_host,
            self.port,
            backlog=1000,
            # On Windows the option would let two servers share a port.
            reuse_address=sys.platform != "win32",
        )
        self.port = self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """Stop listening and end all connections. Idempotent."""
        if self._server is None:
            return
        self._server.close()
        for connection in list(self._connections):
            connection.close()
        self._server = None


class _Connection(asyncio.Protocol):
    """One client: feed, take messages, answer them in order."""

    def __init__(self, dispatch: Dispatch, connections: set[_Connection]) -> None:
        self._dispatch = dispatch
        self._connections = connections
        self._reader = HttpReader()
        self._transport: asyncio.Transport | None = None
        self._deadline: asyncio.TimerHandle | None = None
        self._waiting: list[HttpMessage] = []
        self._task: asyncio.Task[None] | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._connections.add(self)

    def connection_lost(self, exc: Exception | None) -> None:
        self._connections.discard(self)
        self._cancel_deadline()
        if self._task:
            self._task.cancel()

    def close(self) -> None:
        if self._transport:
            self._transport.close()

    def data_received(self, data: bytes) -> None:
        assert self._transport
        try:
            messages = self._reader.feed(data)
        except RpcProtocolError as error:
            status = 413 if "over the limit" in str(error) else 400
            self._transport.write(serialize_error(status, str(error)))
            self._transport.close()
            return
        if self._reader.wants_continue:
            self._transport.write(self._reader.continue_line())
        self._set_deadline()
        for message in messages:
            if self._task:
                self._waiting.append(message)
            else:
                self._answer(message)

    def eof_received(self) -> bool:
        return False

    def _answer(self, message: HttpMessage) -> None:
        """Answer at once, or start a task for a method that has to wait."""
        if message.method != "POST":
            self._refuse(405, "this is an XML-RPC server: send POST")
            return
        try:
            call = parse_call(message.body)
        except RpcProtocolError as error:
            self._refuse(400, str(error))
            return
        body: bytes | None = None
        try:
            value = self._dispatch(call.method, call.args)
            if isinstance(value, Awaitable):
                self._task = asyncio.ensure_future(self._answer_later(value, message.keep_alive))
                return
            body = serialize_value(value)
        except RpcFault as fault:
            body = serialize_fault(fault.code, fault.text)
        except Exception as error:  # noqa: BLE001 - a fault of ours must not end the server
            _log.exception("fault in %s", call.method)
            body = serialize_fault(1, f"{type(error).__name__}: {error}")
        self._send(body, message.keep_alive)

    async def _answer_later(self, value: Awaitable[Any], keep_alive: bool) -> None:
        try:
            body = serialize_value(await value)
        except RpcFault as fault:
            body = serialize_fault(fault.code, fault.text)
        except Exception as error:  # noqa: BLE001 - a fault of ours must not end the server
            _log.exception("fault in a method")
            body = serialize_fault(1, f"{type(error).__name__}: {error}")
        self._task = None
        self._send(body, keep_alive)
        while self._waiting and self._task is None:
            self._answer(self._waiting.pop(0))

    def _send(self, body: bytes, keep_alive: bool) -> None:
        assert self._transport
        self._transport.write(serialize_response(body, keep_alive=keep_alive))
        if not keep_alive:
            self._transport.close()

    def _refuse(self, status: int, text: str) -> None:
        assert self._transport
        self._transport.write(serialize_error(status, text))
        self._transport.close()

    def _set_deadline(self) -> None:
        """A request that has begun has a time limit; an idle connection has none."""
        if self._reader.is_idle:
            self._cancel_deadline()
        elif self._deadline is None:
            self._deadline = asyncio.get_running_loop().call_later(_REQUEST_SECONDS, self.close)

    def _cancel_deadline(self) -> None:
        if self._deadline:
            self._deadline.cancel()
            self._deadline = None


def is_address_in_use(error: OSError) -> bool:
    """Whether listening failed because somebody else listens there."""
    return error.errno == errno.EADDRINUSE or getattr(error, "winerror", None) == 10048
