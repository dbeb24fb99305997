"""An XML-RPC server on the event loop.

Its connections are plain sockets that the loop watches: a master serves thousands of short ones, and an asyncio
transport for each would cost more than all that is done with it.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import socket
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Iterable, Sequence
from enum import Enum
from itertools import islice
from typing import Any

from minirospy.errors import RpcFault, RpcProtocolError
from minirospy.runtime import local, sockets, tcp
from minirospy.runtime.access import Access
from minirospy.runtime.complaints import Complaints
from minirospy.runtime.deadlines import Deadlines
from minirospy.wire.http import HttpMessage, HttpReader, serialize_error, serialize_response
from minirospy.wire.xmlrpc import parse_call, serialize_fault
from minirospy.wire.xmlrpc import serialize_response as serialize_value

__all__ = ["Dispatch", "RpcServer", "is_address_in_use"]

_log = logging.getLogger(__name__)

_REQUEST_SECONDS = 30.0
"""A request that has begun must be whole after this, and an answer taken."""

_LINGER_SECONDS = 2.0
"""Who is refused may still be sending: so long it is heard out, or the answer would be lost with the connection."""

_MOST_HELD = 256 * 1024 * 1024
_LARGE = 1024 * 1024
"""Of requests that are not whole yet, a server holds so much; beyond that the large ones are refused."""

_PROGRESS = 65536
"""Bytes that have moved set the time limit anew: a large value may be long under way by a poor radio."""

_MOST_UNREAD = 256 * 1024
"""Bytes of answers that wait for a client to read them, before it gets no more."""

_RECEIVE = 16384
"""Bytes at a time: what one client pipelines is taken apart before the next one has its turn."""

_END_OF_HEAD = b"\r\n\r\n"
_BACKLOG = 1000
_ACCEPTS_AT_ONCE = 32
_ANSWERS_AT_ONCE = 4
"""Of requests that came together, before others have their turn."""


Dispatch = Callable[[str, Sequence[Any]], Any]
"""Method name and arguments in, value out, or an awaitable of it; raises RpcFault."""


class _State(Enum):
    OPEN = "it is served"
    BUSY = "it asked much at once: nothing more is read from it before that is answered"
    FULL = "it does not read its answers: nothing is read from it"
    CLOSING = "it ends once it has read its answers"
    REFUSED = "it is heard out, without an answer"
    ENDED = "the socket is closed"


_OPEN, _BUSY, _FULL, _CLOSING, _REFUSED, _ENDED = _State


class RpcServer:
    """Serves ``dispatch`` over HTTP at any path, with keep-alive and pipelining."""

    def __init__(
        self,
        dispatch: Dispatch,
        *,
        bind_host: str = "127.0.0.1",
        port: int = 0,
        ports: range | None = None,
        most_idle: int | None = None,
        access: Access | None = None,
        known_as: Iterable[str] = (),
    ) -> None:
        """Port 0 takes a free one, out of ``ports`` where these are given.

        Processes of this machine that know the server by one of the hosts ``known_as`` may come by a Unix socket.

        ``most_idle`` clients are kept, those that spoke last (None: all). Clients that ``access`` does not
        allow are hung up on.
        """
        self.dispatch = dispatch
        self.port = port
        self.refused = 0
        """How many connections were not allowed."""
        self.held = 0
        """Bytes of requests that are not whole yet."""
        self.connections: OrderedDict[_Connection, None] = OrderedDict()
        """Those that spoke last stand at the end."""
        self._bind_host = bind_host
        self._ports = ports
        self._most = most_idle
        self._access = access
        self._known_as = dict.fromkeys(known_as)
        self._sock: socket.socket | None = None
        self._listening: list[socket.socket] = []
        self.deadlines: Deadlines[_Connection] = Deadlines(_Connection.end)
        """Until when a request has to be whole, or an answer taken; idle connections are not in here."""
        self._complaints = Complaints(_log)
        self._strangers = Complaints(_log, 10)

    @property
    def clients(self) -> int:
        """How many clients are connected."""
        return len(self.connections)

    def listen(self) -> None:
        """Take the port, alone; clients that connect wait until :meth:`start`. Idempotent. Raises OSError.

        With port 0 ``port`` is the one that was free from here on.
        """
        if self._sock is not None:
            return
        sock = tcp.bind(self._bind_host, self.port, self._ports)
        try:
            # Those that are accepted take it over.
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            # Two sockets may be bound to one port, as long as none of them listens.
            sock.listen(_BACKLOG)
        except BaseException:
            sock.close()
            raise
        self.port = sock.getsockname()[1]
        self._sock = sock

    async def start(self) -> None:
        """Serve clients, after :meth:`listen`. Raises OSError."""
        self.listen()
        assert self._sock
        self._watch(self._sock)
        for host in self._known_as:
            near = local.bind(host, self.port)
            if near:
                near.listen(_BACKLOG)
                self._watch(near)

    async def close(self) -> None:
        """Stop listening and end all connections. Idempotent."""
        while self._listening:
            sock = self._listening.pop()
            asyncio.get_running_loop().remove_reader(sock)
            sock.close()
        if self._sock is not None:
            self._sock.close()
        for connection in list(self.connections):
            connection.end()
        self.deadlines.close()
        self._complaints.close()
        self._strangers.close()

    def _watch(self, sock: socket.socket) -> None:
        self._listening.append(sock)
        asyncio.get_running_loop().add_reader(sock, self._accept, sock)

    def _watch_again(self, sock: socket.socket) -> None:
        if sock in self._listening:
            asyncio.get_running_loop().add_reader(sock, self._accept, sock)

    def _accept(self, sock: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        for _ in range(_ACCEPTS_AT_ONCE):
            try:
                peer, address = sock.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:
                # Out of file descriptors: the longest silent one makes room, a moment later.
                _log.warning("a connection could not be accepted: %s", error)
                self._end_longest_silent()
                loop.remove_reader(sock)
                loop.call_later(0.05, self._watch_again, sock)
                return
            if peer.family not in sockets.FAMILIES or self._allows(peer, address[0]):
                self._serve(peer, loop)
            else:
                peer.close()

    def _serve(self, peer: socket.socket, loop: asyncio.AbstractEventLoop) -> None:
        try:
            peer.setblocking(False)
        except OSError:
            # It has gone already.
            peer.close()
            return
        if self._most is not None and len(self.connections) >= self._most:
            self._end_longest_silent()
        connection = _Connection(self, peer, loop)
        self.connections[connection] = None
        # Who connects has something to say: mostly its first request is there by now.
        connection.readable()

    def tell_refusal(self, sock: socket.socket, why: str) -> None:
        """Log that a request was refused; a flood of them is summed up."""
        try:
            # Who comes by a Unix socket has no address.
            name = sock.getpeername()[0] if sock.family in sockets.FAMILIES else "this machine"
        except OSError:
            name = "a client"
        self._complaints.warning("a request from %s was refused: %s", name, why)

    def _end_longest_silent(self) -> None:
        """One goes that asks nothing, or else the one that was silent longest."""
        longest_silent = list(islice(self.connections, 20))
        if longest_silent:
            next((each for each in longest_silent if each.is_idle), longest_silent[0]).end()

    def _allows(self, peer: socket.socket, address: str) -> bool:
        if self._access is None or not self._access.networks:
            return True
        with contextlib.suppress(OSError):
            if self._access.allows(address, peer.getsockname()[0]):
                return True
        self.refused += 1
        self._strangers.warning(
            "a connection from %s was refused: only %s may connect", address, self._access
        )
        return False


class _Connection:
    """One client: feed, take messages, answer them in order."""

    __slots__ = (
        "_fd",
        "_has_deadline",
        "_held",
        "_loop",
        "_moved",
        "_out",
        "_reader",
        "_server",
        "_sock",
        "_state",
        "_task",
        "_waiting",
    )

    def __init__(self, server: RpcServer, sock: socket.socket, loop: asyncio.AbstractEventLoop) -> None:
        self._server = server
        self._sock = sock
        self._fd = sock.fileno()
        self._loop = loop
        self._reader = HttpReader()
        self._state: _State = _OPEN
        self._out = bytearray()
        self._waiting: list[HttpMessage] = []
        self._has_deadline = False
        # Bytes since the time limit was set.
        self._moved = 0
        self._task: asyncio.Task[None] | None = None
        self._held = 0
        loop.add_reader(self._fd, self.readable)

    @property
    def is_idle(self) -> bool:
        """Whether no request is under way."""
        return self._state is _OPEN and self._reader.is_idle and self._task is None and not self._out

    def end(self) -> None:
        """Hang up. Idempotent."""
        if self._state is _ENDED:
            return
        self._state = _ENDED
        self._loop.remove_reader(self._fd)
        if self._out:
            self._loop.remove_writer(self._fd)
        self._sock.close()
        self._server.connections.pop(self, None)
        self._hold(0)
        self._waiting.clear()
        self._server.deadlines.drop(self)
        if self._task:
            self._task.cancel()

    def received(self, data: bytes) -> None:
        """Bytes of requests have come."""
        try:
            messages = self._reader.feed(data)
        except RpcProtocolError as error:
            self._refuse(413 if "over the limit" in str(error) else 400, str(error))
            return
        if self._held or not messages:
            self._hold(self._reader.held)
            if self._server.held > _MOST_HELD and self._held > _LARGE:
                self._refuse(503, "too much is being sent at once: try again later")
                return
            if self._reader.wants_continue:
                self._write(self._reader.continue_line())
        if self._has_deadline and messages:
            self._has_deadline = False
            self._server.deadlines.drop(self)
        self._moved += len(data)
        self._waiting += messages
        self._answer_waiting()
        self._set_deadline()

    def _receive(self) -> bytes | None:
        """What has come; b"" at the end, None where nothing has."""
        try:
            return self._sock.recv(_RECEIVE)
        except (BlockingIOError, InterruptedError):
            return None
        except OSError:
            return b""

    def readable(self) -> None:
        """There may be something to read."""
        data = self._receive()
        if data is None:
            return
        if self._state is _REFUSED:
            # Whatever it still says.
            if not data:
                self.end()
            return
        if data:
            self._server.connections.move_to_end(self)
            if data.endswith(_END_OF_HEAD):
                # Clients in Python send the body right behind its head: mostly it is there by now.
                data += self._receive() or b""
            self.received(data)
        elif self._out and self._state is _OPEN:
            # It asks no more, but waits for what it asked.
            self._state = _CLOSING
            self._loop.remove_reader(self._fd)
        else:
            self.end()

    def _answer_waiting(self) -> None:
        left = _ANSWERS_AT_ONCE
        while self._waiting and self._state is _OPEN:
            if self._task or not left:
                self._state = _BUSY
                self._loop.remove_reader(self._fd)
                if not self._task:
                    self._loop.call_soon(self._go_on)
                return
            left -= 1
            self._answer(self._waiting.pop(0))

    def _go_on(self) -> None:
        if self._state is _BUSY:
            self._state = _OPEN
            self._loop.add_reader(self._fd, self.readable)
            self._answer_waiting()
            self._set_deadline()

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
        try:
            value = self._server.dispatch(call.method, call.args)
            if type(value) is not list and isinstance(value, Awaitable):
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
        self._go_on()

    def _send(self, body: bytes, keep_alive: bool) -> None:
        self._write(serialize_response(body, keep_alive=keep_alive))
        if not keep_alive:
            self._close()

    def _refuse(self, status: int, text: str) -> None:
        """Answer with an error, and take nothing more."""
        self._waiting.clear()
        self._hold(0)
        self._server.tell_refusal(self._sock, text)
        self._write(serialize_error(status, text))
        if self._state is _FULL:
            self._loop.add_reader(self._fd, self.readable)
        if self._state in (_OPEN, _FULL):
            self._state = _REFUSED
            if not self._out:
                self._say_end()
            self._limit(_LINGER_SECONDS)

    def _close(self) -> None:
        """Hang up once what is written has been taken."""
        self._waiting.clear()
        if not self._out:
            self.end()
        elif self._state in (_OPEN, _BUSY, _FULL):
            if self._state is _OPEN:
                self._loop.remove_reader(self._fd)
            self._state = _CLOSING

    def _write(self, data: bytes) -> None:
        if self._state is _ENDED:
            return
        sent = 0
        if not self._out:
            try:
                sent = self._sock.send(data)
            except (BlockingIOError, InterruptedError):
                pass
            except OSError:
                self.end()
                return
            if sent == len(data):
                return
            self._loop.add_writer(self._fd, self._writable)
        self._out += memoryview(data)[sent:]
        self._set_deadline()
        if self._state is _OPEN and len(self._out) > _MOST_UNREAD:
            # The client does not read its answers: it gets no more of them, and is not read from.
            self._state = _FULL
            self._loop.remove_reader(self._fd)

    def _writable(self) -> None:
        try:
            sent = self._sock.send(memoryview(self._out)[:_MOST_UNREAD])
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            self.end()
            return
        del self._out[:sent]
        if self._out:
            self._moved += sent
            self._set_deadline()
            return
        self._loop.remove_writer(self._fd)
        if self._state is _CLOSING:
            self.end()
        elif self._state is _REFUSED:
            self._say_end()
        else:
            if self._state is _FULL:
                self._state = _OPEN
                self._loop.add_reader(self._fd, self.readable)
            self._answer_waiting()
            self._set_deadline()

    def _say_end(self) -> None:
        with contextlib.suppress(OSError):
            self._sock.shutdown(socket.SHUT_WR)

    def _hold(self, count: int) -> None:
        self._server.held += count - self._held
        self._held = count

    def _set_deadline(self) -> None:
        """A request that has begun, or an answer that waits, has a time limit; an idle connection has none."""
        if self._out or not self._reader.is_idle:
            is_due = not self._has_deadline or self._moved > _PROGRESS
            if is_due and self._state is not _ENDED and self._state is not _REFUSED:
                self._limit(_REQUEST_SECONDS)
        elif self._has_deadline and self._state is not _REFUSED:
            self._has_deadline = False
            self._server.deadlines.drop(self)

    def _limit(self, seconds: float) -> None:
        self._has_deadline = True
        self._moved = 0
        self._server.deadlines.set(self, seconds)


def is_address_in_use(error: OSError) -> bool:
    """Whether listening failed because somebody else listens there."""
    return error.errno == errno.EADDRINUSE or getattr(error, "winerror", None) == 10048
