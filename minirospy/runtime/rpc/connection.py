"""One client of the XML-RPC server: parses requests, and sends their responses in order.

This module limits each client; the server (``runtime/rpc/server.py``) accepts clients and limits the memory of all
clients together.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import Awaitable, Generator, Sequence
from typing import TYPE_CHECKING

from minirospy.base.errors import RpcFault, RpcProtocolError
from minirospy.base.steps import ALONE, SHORT_ITEMS, Steps, is_small
from minirospy.core.wire.http import (
    MAX_BODY,
    HttpMessage,
    HttpReader,
    serialize_error,
    serialize_response,
    serialize_response_head,
)
from minirospy.core.wire.xmlrpc import Serialized, parse_call, parse_call_in_steps, serialize_fault
from minirospy.core.wire.xmlrpc import serialize_response as serialize_value
from minirospy.core.wire.xmlrpc import serialize_response_in_steps as serialize_value_in_steps
from minirospy.runtime.rpc.connection_state import READING, TRANSITIONS, Event, State
from minirospy.runtime.rpc.outbox import MAX_UNREAD, Outbox

if TYPE_CHECKING:
    from minirospy.runtime.rpc.server import RpcServer

__all__ = ["Connection", "State"]

_log = logging.getLogger(__name__)

# time limit for receiving a request that has started, and for the client to read a response
REQUEST_SECONDS = 30.0

_LINGER_SECONDS = 2.0
"""Keep reading from a refused client for this many seconds; closing earlier resets the connection, and the response is lost."""

_SHORT_BODY = 4096  # maximum bytes of a short body; a longer one is read in steps

# Maximum bytes of a request that is processed together with others; the parsed values may take several times the memory
_ALONE_BODY = 1024 * 1024

PROGRESS_BYTES = (
    # transferred bytes after which the time limit starts again: a large value takes a long time on a slow radio link
    65536
)

_RECEIVE = 4096
_RECEIVE_MORE = 16384
"""Bytes per receive, for a new request and for the rest of a long one.

The first value is small, because all pipelined requests in one receive are parsed before the next client is served.
"""

_END_OF_HEAD = b"\r\n\r\n"

# Number of requests processed immediately if several arrive together; the rest are processed in steps
_ANSWERS_AT_ONCE = 1


_OPEN, _REFUSED, _ENDED = State.OPEN, State.REFUSED, State.ENDED


class Connection:
    """One client: receives data, finds the requests in it, and responds to them in order."""

    __slots__ = (
        "_fd",
        "_has_deadline",
        "_has_requested",
        "_held",
        "_loop",
        "_message",
        "_moved",
        "_must_finish",
        "_out",
        "_reader",
        "_reading",
        "_server",
        "_sock",
        "_state",
        "_task",
        "_work",
        "_work_bytes",
    )

    def __init__(self, server: RpcServer, sock: socket.socket, loop: asyncio.AbstractEventLoop) -> None:
        self._server = server
        self._sock = sock
        self._fd = sock.fileno()
        self._loop = loop
        self._reader = HttpReader()
        self._state: State = _OPEN

        self._out = Outbox(sock)
        # The next request to process. Further requests that arrived with it are still unparsed bytes.
        self._message: HttpMessage | None = None
        self._has_deadline = False
        self._has_requested = False
        # Bytes transferred since the deadline was set.
        self._moved = 0

        self._task: asyncio.Task[None] | None = None
        # The steps that process a long request, and the bytes of its body.
        self._work: Steps[None] | None = None
        self._work_bytes = 0
        # The work changes state, so finish it even if the client no longer waits for the response.
        self._must_finish = False
        self._held = 0
        # Set while the socket is being read in steps.
        self._reading: object | None = None

        loop.add_reader(self._fd, self.readable)

    @property
    def is_idle(self) -> bool:
        """Return whether no request is in progress."""
        return self._state is _OPEN and self._reader.is_idle and not self._is_answering and not self._out

    @property
    def is_refused(self) -> bool:
        """Return whether the connection will send no further responses."""
        return self._state is _REFUSED or self._state is _ENDED

    @property
    def _is_answering(self) -> bool:
        return self._task is not None or self._work is not None

    def end(self) -> None:
        """Close the connection. Idempotent."""
        self._enter(Event.END)

    def _enter(self, event: Event) -> bool:
        """Make the state transition for an event, if there is one, and start or stop reading accordingly.

        Return whether the state changed.
        """
        state = TRANSITIONS[event].get(self._state)
        if state is None:
            return False
        was_reading, self._state = self._state in READING, state
        if was_reading and state not in READING:
            self._stop_reading()
        elif state in READING and not was_reading:
            self._start_reading()
        if state is _ENDED:
            self._release()
        return True

    def _release(self) -> None:
        """Close the socket and discard the request and the output."""
        if self._out:
            self._loop.remove_writer(self._fd)
        self._sock.close()
        self._server.connections.pop(self, None)
        self._drop_request()
        self._count_unread(-self._out.clear())
        self._server.deadlines.drop(self)

    def received(self, data: bytes) -> None:
        """Process received bytes of requests."""
        self._moved += len(data)
        self._find_message(data)
        self._answer_waiting()
        self._set_deadline()

    def _find_message(self, data: bytes = b"") -> bool:
        """Parse the next request from the received bytes and ``data``; return whether it is complete.

        Parses only one request, so that parsing a client's pipelined requests does not delay other clients.
        """
        try:
            message = self._reader.feed_one(data) if data else self._reader.next_message()
        except RpcProtocolError as error:
            self.refuse(error.status, str(error))
            return False

        if self._held or message is None or not self._reader.is_idle:
            self._hold()
            if not self._server.limit_held(self):
                return False
        if message is None:
            if self._reader.wants_continue:
                self._write(self._reader.continue_line())
            return False

        if self._has_deadline:
            self._has_deadline = False
            self._server.deadlines.drop(self)
        self._message = message
        self._has_requested = True
        return True

    def _receive(self, most: int = _RECEIVE) -> bytes | None:
        """Return the bytes that have arrived; b"" at end of file, None if there are none."""
        try:
            return self._sock.recv(most)
        except (BlockingIOError, InterruptedError):
            return None
        except OSError:
            return b""

    def readable(self) -> None:
        """Read. If it is other connections' turn, return without reading; the loop calls this again in its next iteration."""
        if self._server.admit(self, is_new=not self._has_requested):
            self.read()

    def read(self) -> None:
        """Read available bytes. Read in steps if they belong to a long request or come from a refused client."""
        if not self._held and self._state is not _REFUSED:
            self._take(self._receive())
            return
        self._stop_reading()
        reading = self._reading = object()
        self._server.turns.start(self._read_much(reading))

    def _read_much(self, reading: object) -> Steps[None]:
        """Read until no data is left, or until other code has stopped or restarted reading."""
        while self._reading is reading:
            data = self._receive(_RECEIVE if self._reader.in_chunks else _RECEIVE_MORE)
            if data is None:
                self._start_reading()
                return
            self._take(data)
            yield None

    def _stop_reading(self) -> None:
        """Stop reading for now. Idempotent."""
        self._loop.remove_reader(self._fd)
        self._server.drop_late(self)
        self._reading = None

    def _start_reading(self) -> None:
        self._reading = None
        self._loop.add_reader(self._fd, self.readable)

    def _take(self, data: bytes | None) -> None:
        """Process received data: b"" means end of file, None means that no data has arrived."""
        if data is None:
            return

        if self._state is _REFUSED:
            # The client was refused: ignore all data from now on.
            if not data:
                self.end()
            return

        if data:
            self._server.connections.move_to_end(self)
            if data.endswith(_END_OF_HEAD):
                # Python clients send the body right after the head, so it has usually arrived by now.
                data += self._receive() or b""
            self.received(data)
        elif not self._out or not self._enter(Event.END_OF_FILE):
            self.end()

    def _answer_waiting(self) -> None:
        left = _ANSWERS_AT_ONCE
        while self._state is _OPEN and (self._message or self._find_message()):
            if self._is_answering or not left:
                self._enter(Event.PIPELINED)
                if not self._is_answering:
                    self._start(self._answer_rest())
                return
            left -= 1
            message, self._message = self._message, None
            assert message
            self._answer(message)

    def _answer_rest(self) -> Steps[None]:
        """Process the next of several requests that arrived together."""
        yield None
        self._work = None
        self._go_on()

    def _go_on(self) -> None:
        """Continue reading, and process the requests that were waiting for this response."""
        if self._enter(Event.ANSWERED):
            self._answer_waiting()
            self._set_deadline()

    def _answer(self, message: HttpMessage) -> None:
        """Respond to a request immediately or, if that would take longer, in a task or in steps."""
        if message.method != "POST":
            self.refuse(405, "this is an XML-RPC server: send POST")
            return
        keep_alive = message.keep_alive
        if len(message.body) > _SHORT_BODY:
            self._answer_in_steps(message.body, keep_alive)
            return

        try:
            call = parse_call(message.body)
        except RpcProtocolError as error:
            self.refuse(error.status, str(error))
            return

        try:
            value = self._server.dispatch(call.method, call.args)
            if type(value) is Serialized:
                self._send_pieces(value.pieces, keep_alive)
                return
            if type(value) is not list and isinstance(value, Awaitable):
                self._task = asyncio.ensure_future(self._answer_later(value, keep_alive))
                return
            if isinstance(value, Generator) or not is_small(value, SHORT_ITEMS):
                self._start(self._serialize_in_steps(call.method, value, keep_alive))
                return
            body = serialize_value(value)
        except Exception as error:  # noqa: BLE001 - an internal error must not end the server
            body = _fault(call.method, error)
        self._send(body, keep_alive)

    def _answer_in_steps(self, body: bytes | bytearray, keep_alive: bool) -> None:
        self._work_bytes = len(body)
        self._hold()
        if self._server.limit_held(self):
            self._start(self._read_in_steps(body, keep_alive))

    def _start(self, work: Steps[None]) -> None:
        self._work = work
        self._server.turns.start(work)

    def _read_in_steps(self, body: bytes | bytearray, keep_alive: bool) -> Steps[None]:
        """Parse a long request in steps, and respond to it."""
        if len(body) > _ALONE_BODY:
            yield ALONE

        try:
            call = yield from parse_call_in_steps(body)
        except RpcProtocolError as error:
            self._work = None
            self.refuse(error.status, str(error))
            return

        del body
        self._work_bytes = 0
        self._hold()
        try:
            value = self._server.dispatch(call.method, call.args)
        except Exception as error:  # noqa: BLE001 - an internal error must not end the server
            self._finish(_fault(call.method, error), keep_alive)
            return

        if isinstance(value, Awaitable):
            self._work = None
            self._task = asyncio.ensure_future(self._answer_later(value, keep_alive))
            return

        method = call.method
        del call
        yield from self._serialize_in_steps(method, value, keep_alive)

    def _serialize_in_steps(self, method: str, value: object, keep_alive: bool) -> Steps[None]:
        """Respond with a value that may be long, or that is computed in steps."""
        pieces: Sequence[bytes]
        try:
            if isinstance(value, Generator):
                self._must_finish = True
                try:
                    value = yield from value
                finally:
                    self._must_finish = False

            if self.is_refused:
                return
            if isinstance(value, Serialized):
                pieces = value.pieces
            else:
                pieces = yield from serialize_value_in_steps(value, MAX_BODY)
        except Exception as error:  # noqa: BLE001 - an internal error must not end the server
            pieces = (_fault(method, error),)

        del value
        self._work = None
        if not self.is_refused:
            self._send_pieces(pieces, keep_alive)
            self._go_on()

    async def _answer_later(self, value: Awaitable[object], keep_alive: bool) -> None:
        try:
            body = serialize_value(await value)
        except Exception as error:  # noqa: BLE001 - an internal error must not end the server
            body = _fault("a method", error)
        self._task = None
        self._finish(body, keep_alive)

    def _finish(self, body: bytes, keep_alive: bool) -> None:
        """Send the response to a long-running request, then continue with the next one."""
        self._work = None
        if not self.is_refused:
            self._send(body, keep_alive)
            self._go_on()

    def _send(self, body: bytes, keep_alive: bool) -> None:
        self._write(serialize_response(body, keep_alive=keep_alive))
        self._sent(keep_alive)

    def _send_pieces(self, pieces: Sequence[bytes], keep_alive: bool) -> None:
        """Send a response in pieces; the pieces of a long response are not joined."""
        if len(pieces) == 1:
            self._send(pieces[0], keep_alive)
            return
        self._write(serialize_response_head(sum(map(len, pieces)), keep_alive=keep_alive), *pieces)
        self._sent(keep_alive)

    def _sent(self, keep_alive: bool) -> None:
        if not keep_alive:
            self._close()

    def log_refusal(self, why: str) -> None:
        """Log that one of the client's requests was refused."""
        self._server.log_refusal(self._sock, why)

    def _drop_request(self) -> None:
        """Discard the current request and its data."""
        self._message = None
        self._reader.close()
        self._work_bytes = 0
        self._hold()
        work, self._work = self._work, None
        if work and not self._must_finish:
            self._server.turns.cancel(work)
        if self._task:
            self._task.cancel()

    def refuse(self, status: int, text: str) -> None:
        """Respond with an error, and accept no more requests."""
        if self.is_refused:
            return
        self._drop_request()
        self.log_refusal(text)
        self._write(serialize_error(status, text))
        if self._enter(Event.REFUSE):
            if not self._out:
                self._say_end()
            self._limit(_LINGER_SECONDS)

    def _close(self) -> None:
        """Close the connection after the pending output has been sent."""
        self._message = None
        if not self._out:
            self.end()
        else:
            self._enter(Event.LAST_ANSWER)

    def _write(self, *pieces: bytes) -> None:
        """Send as much as the socket accepts, and queue the rest."""
        if self._state is _ENDED:
            return
        was_empty = not self._out
        try:
            kept = self._out.write(pieces)
        except OSError:
            self.end()
            return
        if not kept:
            return

        if was_empty:
            self._loop.add_writer(self._fd, self._writable)
        self._count_unread(kept)
        self._set_deadline()
        if self._out.size > MAX_UNREAD:
            # Send no more responses and stop reading requests.
            self._enter(Event.UNREAD)
        self._server.limit_unread()

    def _count_unread(self, more: int) -> None:
        """Add ``more`` (which may be negative) to the number of response bytes that the client has not read."""
        self._server.unread += more
        if not self._out:
            self._server.slow.pop(self, None)
        elif more < 0:
            self._server.slow.move_to_end(self)
        else:
            self._server.slow.setdefault(self, None)

    def _writable(self) -> None:
        try:
            sent = self._out.flush()
        except OSError:
            self.end()
            return

        if sent:
            self._count_unread(-sent)

        if self._out:
            self._moved += sent
            self._set_deadline()
            return

        self._loop.remove_writer(self._fd)
        if self._state is _REFUSED:
            self._say_end()
            return
        self._enter(Event.DRAINED)
        if self._state is not _ENDED:
            self._answer_waiting()
            self._set_deadline()

    def _say_end(self) -> None:
        with contextlib.suppress(OSError):
            self._sock.shutdown(socket.SHUT_WR)

    def _hold(self) -> None:
        """Update the count of bytes buffered for the current request."""
        count = self._reader.held + self._work_bytes
        if count == self._held:
            return
        self._server.held += count - self._held
        self._held = count
        if count:
            self._server.holders[self] = count
        else:
            self._server.holders.pop(self, None)

    def _set_deadline(self) -> None:
        """Set the time limit for a started request or a pending response; an idle connection has none."""
        if self._out or not self._reader.is_idle:
            is_due = not self._has_deadline or self._moved > PROGRESS_BYTES
            if is_due and self._state is not _ENDED and self._state is not _REFUSED:
                self._limit(REQUEST_SECONDS)
        elif self._has_deadline and self._state is not _REFUSED:
            self._has_deadline = False
            self._server.deadlines.drop(self)

    def _limit(self, seconds: float) -> None:
        self._has_deadline = True
        self._moved = 0
        self._server.deadlines.set(self, seconds)


def _fault(method: str, error: Exception) -> bytes:
    """Serialize the error response to a failed call."""
    match error:
        case RpcFault():
            return serialize_fault(error.code, error.text)
        case RpcProtocolError():
            _log.warning("%s cannot be answered: %s", method, error)
        case _:
            _log.error("fault in %s", method, exc_info=error)
    return serialize_fault(1, f"{type(error).__name__}: {error}")
