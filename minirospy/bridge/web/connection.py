"""One connection of a browser or program: HTTP request in, then an answer, a stream, or a WebSocket.

The WebSocket's bytes are parsed by the library ``websockets`` (its part without sockets); frames are written here, so that a
message goes into the socket without being copied for each client. Source: RFC 6455, RFC 9112.
"""

from __future__ import annotations

import asyncio
import http
import logging
import struct
import time
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, Protocol
from urllib.parse import parse_qs, unquote, urlsplit

from websockets.exceptions import NegotiationError
from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State
from websockets.server import ServerProtocol

from minirospy.bridge.access import TOKEN_PROTOCOL, Credentials, Grant, Refusal, header_items
from minirospy.bridge.web.queue import DEFAULT_LIMIT, Piece, SendQueue
from minirospy.escape import escaped

if TYPE_CHECKING:
    from websockets.typing import Subprotocol

    from minirospy.bridge.web.pipe import Pipe

__all__ = [
    "Connection",
    "Door",
    "Exchange",
    "HttpHandler",
    "HttpRequest",
    "Limits",
    "Session",
    "Site",
    "WebClient",
]

_log = logging.getLogger(__name__)

_HEAD_16 = struct.Struct("!BBH")
_HEAD_64 = struct.Struct("!BBQ")
_TEXT = 0x81
_BINARY = 0x82
_BATCH_BYTES = 256 * 1024
_BATCH_PIECES = 128


@dataclass(frozen=True)
class Limits:
    """The limits of one client: bytes of a message, messages and bytes a second, seconds without progress, connections."""

    message: int = 64_000_000
    messages_a_second: int = 20_000
    queue: int = DEFAULT_LIMIT
    connections: int = 256
    handshake_seconds: float = 10.0
    ping_seconds: float = 20.0
    silent_seconds: float = 60.0
    """A client that answers no ping, or takes no byte, for this long is disconnected."""


class HttpRequest(NamedTuple):
    """A request; names of headers are in lower case."""

    path: str
    query: Mapping[str, str]
    headers: Mapping[str, str]
    peer: str


class Session(Protocol):
    """A client of a protocol. Called on the loop; what it raises ends the connection."""

    def received_text(self, text: str) -> None: ...

    def received_binary(self, data: bytes) -> None: ...

    def ended(self) -> None: ...


class Door(Protocol):
    """A protocol over WebSocket."""

    def select(self, offered: Sequence[str]) -> str | None:
        """Return the sub-protocol to use, None for none. Raise LookupError with the reason for a refusal."""

    def open(self, client: WebClient) -> Session: ...


HttpHandler = Callable[["Exchange"], None]
"""Answers a request now, or later, by the methods of the exchange."""


class Site(Protocol):
    """The contents that a listener serves."""

    @property
    def limits(self) -> Limits: ...

    @property
    def doors(self) -> Sequence[Door]: ...

    def check(self, credentials: Credentials) -> Grant | Refusal: ...

    def page(self, path: str) -> HttpHandler | None: ...

    def left(self, connection: Connection) -> None: ...


@dataclass
class Traffic:
    """The traffic of a client, and how often its reading was held back."""

    received: int = 0
    received_bytes: int = 0
    held_back: int = 0
    since: float = field(default_factory=time.monotonic)


class WebClient:
    """One WebSocket client, for the session of its protocol."""

    def __init__(
        self, connection: Connection, request: HttpRequest, grant: Grant, subprotocol: str | None
    ) -> None:
        self.request = request
        self.grant = grant
        self.subprotocol = subprotocol
        self._connection = connection

    @property
    def name(self) -> str:
        """Return the client's address, for people."""
        return self.request.peer

    @property
    def may_write(self) -> bool:
        """Return whether the client may publish, call services and set parameters."""
        return self.grant is Grant.WRITE

    @property
    def queue(self) -> SendQueue:
        """Return the frames that wait for the client, and the counts."""
        return self._connection.queue

    def send_text(self, text: str) -> None:
        """Send an answer as text; it is never dropped."""
        data = text.encode()
        self._connection.answer((frame_head(_TEXT, len(data)), data))

    def send_binary(self, *pieces: Piece) -> None:
        """Send an answer as one binary message; it is never dropped."""
        self._connection.answer((frame_head(_BINARY, sum(map(len, pieces))), *pieces))

    def send_message(self, key: Hashable, head: bytes, payload: Piece, *, newest_only: bool = False) -> None:
        """Send a message of a stream as one binary message; older ones of ``key`` give way where the client is slow."""
        front = frame_head(_BINARY, len(head) + len(payload)) + head
        self._connection.stream(key, (front, payload), newest_only=newest_only)

    def send_text_message(self, key: Hashable, text: bytes, *, newest_only: bool = False) -> None:
        """Do the same as a text message; ``text`` is UTF-8."""
        self._connection.stream(key, (frame_head(_TEXT, len(text)), text), newest_only=newest_only)

    def discard(self, key: Hashable) -> None:
        """Drop what waits under a key."""
        self._connection.queue.discard(key)

    def close(self, code: int = CloseCode.NORMAL_CLOSURE, reason: str = "") -> None:
        """End the connection after what waits; ``reason`` is cut to 123 bytes."""
        self._connection.close_websocket(code, reason)


class Exchange:
    """One HTTP request and its answer."""

    def __init__(self, connection: Connection, request: HttpRequest, grant: Grant) -> None:
        self.request = request
        self.grant = grant
        self.on_end: Callable[[], None] = lambda: None
        """Called when the client has disconnected."""
        self._connection = connection

    @property
    def queue(self) -> SendQueue:
        """Return the frames that wait for the client, and the counts."""
        return self._connection.queue

    def respond(
        self, status: int, body: bytes, content_type: str = "text/plain; charset=utf-8", **headers: str
    ) -> None:
        """Answer, and close the connection."""
        head = _response_head(status, {**_PLAIN_HEADERS, "Content-Type": content_type,
                                       "Content-Length": str(len(body)), **_dashed(headers)})  # fmt: skip
        self._connection.answer((head, body))
        self._connection.close_when_sent()

    def start(self, status: int, content_type: str, **headers: str) -> None:
        """Start an answer whose parts follow, until :meth:`end`."""
        self._connection.answer(
            (_response_head(status, {**_PLAIN_HEADERS, "Content-Type": content_type, **_dashed(headers)}),)
        )

    def send(self, key: Hashable, *pieces: Piece, newest_only: bool = True) -> None:
        """Send a part; older ones of ``key`` give way where the client is slow."""
        self._connection.stream(key, pieces, newest_only=newest_only)

    def end(self) -> None:
        """End the answer after what waits."""
        self._connection.close_when_sent()


_PLAIN_HEADERS = {
    "Connection": "close",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}


class Connection:
    """The state of one connection; the events of its pipe come in here."""

    def __init__(self, site: Site, pipe: Pipe, peer: str, loop: asyncio.AbstractEventLoop) -> None:
        self.peer = peer
        self.queue = SendQueue(site.limits.queue)
        self.traffic = Traffic()
        self.session: Session | None = None
        self.client: WebClient | None = None
        self.exchange: Exchange | None = None
        self._site = site
        self._pipe = pipe
        self._loop = loop
        self._protocol = ServerProtocol(
            select_subprotocol=lambda _, offered: self._select(offered),
            max_size=site.limits.message,
            logger=_QUIET,
        )

        self._door: Door | None = None
        self._fragments: list[bytes] = []
        self._opcode = Opcode.BINARY
        self._is_scheduled = False
        self._is_closing = False
        self._is_over = False
        self._second = 0.0
        self._in_second = 0
        self._sent_mark = (0, 0)
        self._heard = loop.time()
        self._progressed = loop.time()
        self._timer = loop.call_later(site.limits.handshake_seconds, self._handshake_late)
        self._limits = site.limits

    # --- from the pipe

    def received(self, data: bytes) -> None:
        """Take over bytes of the client."""
        if self._is_closing:
            return
        self._heard = self._loop.time()
        self.traffic.received_bytes += len(data)
        self._protocol.receive_data(data)
        self._handle_events()

    def writable(self) -> None:
        """Send more."""
        self._pump()

    def ended(self) -> None:
        """Forget the connection."""
        if self._is_over:
            return
        self._is_over = self._is_closing = True
        self._timer.cancel()
        try:
            if self.session:
                self.session.ended()
            if self.exchange:
                self.exchange.on_end()
        except Exception:  # noqa: BLE001 a fault of one session is not that of others
            _log.exception("the end of a client's session")
        self.session = self.exchange = None
        self._site.left(self)

    # --- to the pipe

    def answer(self, pieces: tuple[Piece, ...]) -> None:
        """Send what is never dropped."""
        if self._is_closing:
            return
        self.queue.put_answer(pieces)
        if self.queue.is_overrun:
            _log.warning("%s reads no answers: disconnected", self.peer)
            self._abort()
            return
        self._schedule()

    def stream(self, key: Hashable, pieces: tuple[Piece, ...], *, newest_only: bool) -> None:
        """Send what may be dropped."""
        if not self._is_closing:
            self.queue.put(key, pieces, newest_only=newest_only)
            self._schedule()

    def close_when_sent(self) -> None:
        """End the connection after what waits."""
        self._is_closing = True
        self._schedule()
        self._timer.cancel()
        self._timer = self._loop.call_later(self._limits.handshake_seconds, self._abort)

    def close_websocket(self, code: int, reason: str) -> None:
        """Say why, and end the connection after what waits."""
        if self._is_closing or self._protocol.state is not State.OPEN:
            return
        self._protocol.send_close(code, _cut(reason))
        self._answer_protocol()
        self.close_when_sent()

    def abort(self) -> None:
        """End the connection now."""
        self._abort()

    # --- within

    def _handle_events(self) -> None:
        for event in self._protocol.events_received():
            if isinstance(event, Request):
                self._requested(event)
            elif isinstance(event, Frame):
                self._framed(event)
            if self._is_closing:
                return
        if self._protocol.handshake_exc and self.client is None:
            self._refuse(Refusal(400, f"not a request for this server: {self._protocol.handshake_exc}"))
            return
        self._answer_protocol()
        if self._protocol.state in (State.CLOSING, State.CLOSED) and self.client:
            self.close_when_sent()

    def _answer_protocol(self) -> None:
        data = tuple(piece for piece in self._protocol.data_to_send() if piece)
        if data:
            self.answer(data)

    def _requested(self, request: Request) -> None:
        self._timer.cancel()
        headers = {name.lower(): value for name, value in request.headers.raw_items()}
        credentials = Credentials(
            headers.get("host", ""),
            headers.get("origin"),
            headers.get("authorization", ""),
            _items(headers, "sec-websocket-protocol"),
            request.path,
        )
        grant = self._site.check(credentials)
        if isinstance(grant, Refusal):
            self._refuse(grant)
            return

        parts = urlsplit(request.path)
        query = {name: values[-1] for name, values in parse_qs(parts.query, keep_blank_values=True).items()}
        seen = HttpRequest(unquote(parts.path), query, headers, self.peer)
        if headers.get("upgrade", "").lower() != "websocket":
            self._serve_page(seen, grant)
            return

        response = self._protocol.accept(request)
        if response.status_code != http.HTTPStatus.SWITCHING_PROTOCOLS or self._door is None:
            text = bytes(response.body or b"").decode(errors="replace").strip().partition(": ")[2]
            self._refuse(Refusal(response.status_code, text or "not a WebSocket request"))
            return
        self._protocol.send_response(response)
        self._answer_protocol()
        self.client = WebClient(self, seen, grant, self._protocol.subprotocol)
        self._timer = self._loop.call_later(self._limits.ping_seconds, self._ping)
        self.session = self._door.open(self.client)

    def _select(self, offered: Sequence[Subprotocol]) -> Subprotocol | None:
        names = [name for name in offered if not name.startswith(TOKEN_PROTOCOL)]
        why = "nothing is served here"
        for door in self._site.doors:
            try:
                chosen = door.select(names)
            except LookupError as error:
                why = str(error.args[0])
                continue
            self._door = door
            return chosen  # type: ignore[return-value]
        raise NegotiationError(why)

    def _serve_page(self, request: HttpRequest, grant: Grant) -> None:
        handler = self._site.page(request.path)
        if handler is None:
            self._refuse(Refusal(404, "there is no such page; WebSocket clients are served here"))
            return
        self.exchange = Exchange(self, request, grant)
        self._progressed = self._loop.time()
        self._timer = self._loop.call_later(self._limits.ping_seconds, self._watch_progress)
        try:
            handler(self.exchange)
        except Exception:  # noqa: BLE001 whatever the page's handler raises
            _log.exception("a page could not be served")
            self._abort()

    def _refuse(self, refusal: Refusal) -> None:
        _log.info("refused %s: %d %s", self.peer, refusal.status, escaped(refusal.text))
        body = (refusal.text + "\n").encode()
        extra = {"WWW-Authenticate": "Bearer"} if refusal.status == 401 else {}
        self.answer(
            (
                _response_head(
                    refusal.status,
                    {
                        **_PLAIN_HEADERS,
                        "Content-Type": "text/plain; charset=utf-8",
                        "Content-Length": str(len(body)),
                        **extra,
                    },
                ),
                body,
            )
        )
        self.close_when_sent()

    def _framed(self, frame: Frame) -> None:
        if frame.opcode in (Opcode.TEXT, Opcode.BINARY):
            self._opcode = frame.opcode
        elif frame.opcode is not Opcode.CONT:
            return
        if not frame.fin:
            self._fragments.append(bytes(frame.data))
            return
        data = bytes(frame.data)
        if self._fragments:
            data = b"".join((*self._fragments, data))
            self._fragments.clear()
        self._delivered(data)

    def _delivered(self, data: bytes) -> None:
        assert self.session
        self.traffic.received += 1
        self._count_in_second()
        try:
            if self._opcode is Opcode.BINARY:
                self.session.received_binary(data)
            else:
                self.session.received_text(data.decode())
        except UnicodeDecodeError:
            self.close_websocket(CloseCode.INVALID_DATA, "text that is not UTF-8")
        except Exception:  # noqa: BLE001 whatever a session raises ends this client alone
            _log.exception("a message of %s could not be handled", self.peer)
            self.close_websocket(CloseCode.INTERNAL_ERROR, "the bridge failed on this message")

    def _count_in_second(self) -> None:
        """Hold a client back that sends more messages than it may."""
        now = self._loop.time()
        if now - self._second >= 1.0:
            self._second, self._in_second = now, 0
        self._in_second += 1
        if self._in_second == self._limits.messages_a_second:
            self.traffic.held_back += 1
            self._pipe.pause()
            self._loop.call_later(self._second + 1.0 - now, self._pipe.resume)

    def _schedule(self) -> None:
        # What arrives in the same turn of the loop goes out with one call.
        if not self._is_scheduled and not self._pipe.is_full:
            self._is_scheduled = True
            self._loop.call_soon(self._pump)

    def _pump(self) -> None:
        self._is_scheduled = False
        if self._is_over:
            return

        while not self._pipe.is_full:
            batch: list[Piece] = []
            size = 0
            while size < _BATCH_BYTES and len(batch) < _BATCH_PIECES:
                pieces = self.queue.pop()
                if pieces is None:
                    break
                batch += pieces
                size += sum(map(len, pieces))
            if not batch:
                if self._is_closing:
                    self._pipe.close()
                return
            self._progressed = self._loop.time()
            self._pipe.write(batch)
            if self._is_over:
                return

    def _ping(self) -> None:
        """See whether the client is there: it answers a ping, or takes what is sent."""
        now = self._loop.time()
        stuck = self._pipe.is_full and now - self._progressed > self._limits.silent_seconds
        if stuck or now - self._heard > self._limits.silent_seconds:
            _log.info("%s %s: disconnected", self.peer, "reads nothing" if stuck else "does not answer")
            self._abort()
            return
        if not self._pipe.is_full:
            self._protocol.send_ping(b"minirospy")
            self._answer_protocol()
        self._timer = self._loop.call_later(self._limits.ping_seconds, self._ping)

    def _watch_progress(self) -> None:
        now = self._loop.time()
        if self._pipe.is_full and now - self._progressed > self._limits.silent_seconds:
            self._abort()
            return
        self._timer = self._loop.call_later(self._limits.ping_seconds, self._watch_progress)

    def _handshake_late(self) -> None:
        _log.info("%s sent no request in time", self.peer)
        self._abort()

    def _abort(self) -> None:
        self._is_closing = True
        self._pipe.close(flush=False)


def frame_head(opcode: int, length: int) -> bytes:
    """Return the head of a server's frame that is a whole message."""
    if length < 126:
        return bytes((opcode, length))
    if length < 65536:
        return _HEAD_16.pack(opcode, 126, length)
    return _HEAD_64.pack(opcode, 127, length)


def _response_head(status: int, headers: Mapping[str, str]) -> bytes:
    lines = [f"HTTP/1.1 {status} {http.HTTPStatus(status).phrase}"]
    lines += [f"{name}: {value}" for name, value in headers.items()]
    return ("\r\n".join(lines) + "\r\n\r\n").encode("latin-1", errors="replace")


def _dashed(headers: Mapping[str, str]) -> dict[str, str]:
    return {name.replace("_", "-"): value for name, value in headers.items()}


def _items(headers: Mapping[str, str], name: str) -> list[str]:
    return header_items(headers, name)


def _cut(reason: str) -> str:
    return reason.encode()[:123].decode(errors="ignore")


_QUIET = logging.getLogger("minirospy.bridge.websockets")
# It logs each frame at DEBUG, tokens in headers among them.
_QUIET.addHandler(logging.NullHandler())
_QUIET.propagate = False
_QUIET.setLevel(logging.CRITICAL)
