"""The objects through which sessions and page handlers send data: a WebSocket client, and an HTTP exchange."""

from __future__ import annotations

import http
import struct
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, Protocol

from minirospy.web.access import Grant
from minirospy.web.server.account import MAX_BYTES
from minirospy.web.server.files import FileAnswer
from minirospy.web.server.queue import DEFAULT_LIMIT, Piece, SendQueue

__all__ = [
    "PLAIN_HEADERS",
    "ClientConnection",
    "Endpoint",
    "Exchange",
    "HttpHandler",
    "HttpRequest",
    "Limits",
    "Session",
    "WebClient",
    "frame_head",
    "response_head",
]

_HEAD_16 = struct.Struct("!BBH")
_HEAD_64 = struct.Struct("!BBQ")
_TEXT = 0x81
_BINARY = 0x82

PLAIN_HEADERS = {
    "Connection": "close",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
"""The headers of every response.

The headers prevent caching, because the contents change constantly, and the path may contain a token.
"""


@dataclass(frozen=True)
class Limits:
    """Limits for one client: bytes per message, frames per second, queued bytes, seconds without progress.

    ``connections`` is the maximum number of all clients together; an address may open ``connections_a_second``, and initially
    ``connection_burst``.
    """

    message: int = 64_000_000
    read_only_message: int = 64 * 1024
    """Maximum bytes per message from a read-only client, which subscribes but does not send large messages."""
    memory: int = MAX_BYTES
    """Maximum memory, in bytes, used for all clients together; see account.py."""
    messages_a_second: int = 20_000
    """Maximum number of frames of any kind, including empty frames, pings and fragments of a message."""
    queue: int = DEFAULT_LIMIT
    connections: int = 256
    connections_a_second: float = 50.0
    connection_burst: int = 500
    reserve: int = 32
    """Number of connections allowed above ``connections`` until their request is known."""
    handshake_seconds: float = 30.0
    """Seconds for the handshake. Longer than the ten seconds within which a browser uses a connection that it opened in
    advance.
    """
    ping_seconds: float = 20.0
    silent_seconds: float = 60.0
    """Seconds after which a client is disconnected if it responds to no ping or reads no data."""


class HttpRequest(NamedTuple):
    """An HTTP request. The names of the headers are in lower case."""

    path: str
    query: Mapping[str, str]
    headers: Mapping[str, str]
    peer: str
    peer_port: int = 0
    address: str = ""
    port: int = 0
    """The client's port, then the server's address and port; see Endpoints in pipe.py."""


class Session(Protocol):
    """The session of one client in a protocol. Methods are called on the loop; an exception closes the connection."""

    def received_text(self, text: str) -> None: ...

    def received_binary(self, data: bytes) -> None: ...

    def ended(self) -> None: ...


class Endpoint(Protocol):
    """A protocol that the server offers over WebSocket."""

    def select(self, offered: Sequence[str]) -> str | None:
        """Return the sub-protocol to use, or None for no sub-protocol.

        Raise LookupError, with the reason, to refuse the client.
        """

    def open(self, client: WebClient) -> Session: ...


HttpHandler = Callable[["Exchange"], None]
"""A function that responds to a request immediately or later, with the exchange's methods."""


class ClientConnection(Protocol):
    """The methods of a client's connection that :class:`WebClient` and :class:`Exchange` use."""

    @property
    def is_open(self) -> bool: ...

    @property
    def queue(self) -> SendQueue: ...

    def answer(self, pieces: tuple[Piece, ...]) -> None: ...

    def answer_file(self, answer: FileAnswer) -> None: ...

    def stream(self, key: Hashable, pieces: tuple[Piece, ...], *, newest_only: bool) -> None: ...

    def session_holds(self, count: int) -> None: ...

    def in_turn(self, work: Callable[[], None], message: Piece) -> None: ...

    def hold_jobs(self, *, are_held: bool) -> None: ...

    def hold(self, *, is_held: bool) -> None: ...

    def close_websocket(self, code: int, reason: str) -> None: ...

    def close_when_sent(self) -> None: ...


class WebClient:
    """A WebSocket client, with the methods that its session uses."""

    def __init__(
        self, connection: ClientConnection, request: HttpRequest, grant: Grant, subprotocol: str | None
    ) -> None:
        self.request = request
        self.grant = grant
        self.subprotocol = subprotocol
        self._connection = connection

    @property
    def name(self) -> str:
        """Return the client's address, for display."""
        return self.request.peer

    @property
    def may_write(self) -> bool:
        """Return whether the client may publish, call services and set parameters."""
        return self.grant is not Grant.READ

    @property
    def is_owner(self) -> bool:
        """Return whether the client may start programs, and open files, as the server's user."""
        return self.grant is Grant.OWN

    def why_not_owner(self, what: str) -> str:
        """Return the error for a client that may not do ``what`` because it is not the owner."""
        if self.may_write:
            return f"only a client that has the token may {what}: open the link that the command printed"
        return f"this token is read-only: it does not let you {what}"

    @property
    def queue(self) -> SendQueue:
        """Return the queue of frames to the client, with its counters."""
        return self._connection.queue

    def send_text(self, text: str) -> None:
        """Send a response as a text message, which is never dropped."""
        data = text.encode()
        self._connection.answer((frame_head(_TEXT, len(data)), data))

    def send_binary(self, *pieces: Piece) -> None:
        """Send a response as a single binary message, which is never dropped."""
        self._connection.answer((frame_head(_BINARY, sum(map(len, pieces))), *pieces))

    def send_file(self, answer: FileAnswer) -> None:
        """Send a file as a single binary message. It is read in pieces when it reaches the front of the queue.

        The parts of ``answer`` do not include WebSocket frame headers.
        """
        self._connection.answer_file(
            FileAnswer(answer.open, partial(_file_head, answer), partial(_file_failure, answer))
        )

    def holds(self, count: int) -> None:
        """Record how many bytes of memory the session uses for the client's current message and its queued messages."""
        self._connection.session_holds(count)

    def send_message(self, key: Hashable, head: bytes, payload: Piece, *, newest_only: bool = False) -> None:
        """Send a binary message of the stream ``key``. If the client is slow, drop older messages of the stream."""
        front = frame_head(_BINARY, len(head) + len(payload)) + head
        self._connection.stream(key, (front, payload), newest_only=newest_only)

    def send_text_message(self, key: Hashable, text: bytes, *, newest_only: bool = False) -> None:
        """Send a text message (UTF-8) of a stream, like :meth:`send_message`."""
        self._connection.stream(key, (frame_head(_TEXT, len(text)), text), newest_only=newest_only)

    def send_texts(self, key: Hashable, texts: Sequence[str], *, newest_only: bool = False) -> None:
        """Send one message of a stream as several text messages; these are queued or dropped together."""
        pieces: list[Piece] = []
        for text in texts:
            data = text.encode()
            pieces += (frame_head(_TEXT, len(data)), data)
        self._connection.stream(key, tuple(pieces), newest_only=newest_only)

    def discard(self, key: Hashable) -> None:
        """Remove the queued messages of a stream."""
        self._connection.queue.discard(key)

    def in_turn(self, work: Callable[[], None], message: Piece) -> None:
        """Run ``work``, a slow function, when it is the client's turn.

        ``work`` uses ``message``, whose bytes are counted until then.
        """
        self._connection.in_turn(work, message)

    def hold_work(self, *, is_held: bool) -> None:
        """Stop running the functions passed to :meth:`in_turn` if ``is_held``, otherwise continue running them.

        Used to preserve the order while the last one continues in a thread.
        """
        self._connection.hold_jobs(are_held=is_held)

    def pause(self) -> None:
        """Stop handling messages from the client until :meth:`resume`."""
        self._connection.hold(is_held=True)

    def resume(self) -> None:
        """Continue handling messages from the client."""
        self._connection.hold(is_held=False)

    def close(self, code: int = 1000, reason: str = "") -> None:
        """Send the queued messages, then close the connection. ``reason`` is truncated to 123 bytes."""
        self._connection.close_websocket(code, reason)


class Exchange:
    """An HTTP request and its response."""

    def __init__(self, connection: ClientConnection, request: HttpRequest, grant: Grant) -> None:
        self.request = request
        self.grant = grant
        self.on_end: Callable[[], None] = lambda: None
        """Called once the client has disconnected."""
        self._connection = connection

    @property
    def is_open(self) -> bool:
        """Return whether the client is connected and the response has not ended."""
        return self._connection.is_open

    @property
    def queue(self) -> SendQueue:
        """Return the queue of data to the client, with its counters."""
        return self._connection.queue

    def respond(
        self, status: int, body: bytes, content_type: str = "text/plain; charset=utf-8", **headers: str
    ) -> None:
        """Send a complete response, then close the connection."""
        head = response_head(status, {**PLAIN_HEADERS, "Content-Type": content_type,
                                       "Content-Length": str(len(body)), **_dashed(headers)})  # fmt: skip
        self._connection.answer((head, body))
        self._connection.close_when_sent()

    def start(self, status: int, content_type: str, **headers: str) -> None:
        """Start a response, whose parts are sent with :meth:`send`; :meth:`end` ends it."""
        self._connection.answer(
            (response_head(status, {**PLAIN_HEADERS, "Content-Type": content_type, **_dashed(headers)}),)
        )

    def send(self, key: Hashable, *pieces: Piece, newest_only: bool = True) -> None:
        """Send a part of the response. If the client is slow, drop older parts with the same ``key``."""
        self._connection.stream(key, pieces, newest_only=newest_only)

    def end(self) -> None:
        """End the response after sending the queued parts."""
        self._connection.close_when_sent()


def _file_head(answer: FileAnswer, size: int) -> bytes:
    head = answer.head(size)
    return frame_head(_BINARY, len(head) + size) + head


def _file_failure(answer: FileAnswer, why: str) -> bytes:
    message = answer.failure(why)
    return frame_head(_BINARY, len(message)) + message


def frame_head(opcode: int, length: int) -> bytes:
    """Return the header of a frame from the server that contains a whole message of ``length`` bytes."""
    if length < 126:
        return bytes((opcode, length))
    if length < 65536:
        return _HEAD_16.pack(opcode, 126, length)
    return _HEAD_64.pack(opcode, 127, length)


def response_head(status: int, headers: Mapping[str, str]) -> bytes:
    lines = [f"HTTP/1.1 {status} {http.HTTPStatus(status).phrase}"]
    lines += [f"{name}: {value}" for name, value in headers.items()]
    return ("\r\n".join(lines) + "\r\n\r\n").encode("latin-1", errors="replace")


def _dashed(headers: Mapping[str, str]) -> dict[str, str]:
    return {name.replace("_", "-"): value for name, value in headers.items()}
