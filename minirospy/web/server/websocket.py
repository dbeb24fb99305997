"""The WebSocket protocol of one client: parses received bytes into messages and pings, one frame at a time. Pure.

The sockets-free part of the library ``websockets`` parses the bytes; :mod:`minirospy.web.server.frames` stops it after
each frame. :class:`minirospy.web.server.client.WebClient` writes the frames of messages, so that a message is sent to
many clients without a copy for each. Source: RFC 6455.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from websockets.frames import Frame, Opcode
from websockets.protocol import State

from minirospy.web.access import TOKEN_PROTOCOL
from minirospy.web.server.frames import FrameByFrame

if TYPE_CHECKING:
    from websockets.http11 import Request, Response
    from websockets.typing import Subprotocol

__all__ = ["FrameRate", "Message", "Ping", "WebSocket"]

_MAX_REASON = 123  # maximum bytes of the reason in a close frame (RFC 6455)


class Message(NamedTuple):
    """A complete message from the client."""

    is_text: bool
    data: bytes


class Ping(NamedTuple):
    """A ping from the client. The response must contain ``data``."""

    data: bytes


class FrameRate:
    """Limits the number of frames per second that a client may send."""

    def __init__(self, max_frames: int) -> None:
        self.count = 0  # number of frames handled in the current second
        self._max_frames = max_frames
        self._start = 0.0  # start of the current second

    @property
    def is_used_up(self) -> bool:
        """Return whether the client has used up its frame quota for the current second."""
        return self.count >= self._max_frames

    def update(self, now: float) -> None:
        """Start a new window of one second if the current one has ended."""
        if now - self._start >= 1.0:
            self._start, self.count = now, 0

    def seconds_left(self, now: float) -> float:
        """Return the seconds until the client may send more frames."""
        return self._start + 1.0 - now


class WebSocket:
    """The protocol state of one client: the handshake, an incomplete message, and the close."""

    def __init__(
        self, select: Callable[[Sequence[str]], str | None], max_size: int, max_frames_a_second: int
    ) -> None:
        """Create the state. ``select(offered)`` returns the sub-protocol to use, or raises NegotiationError to refuse all."""
        self.rate = FrameRate(max_frames_a_second)
        self._frames = FrameByFrame(
            select_subprotocol=lambda _, offered: _select(select, offered),
            max_size=max_size,
            logger=_QUIET,
        )
        self._fragments = bytearray()  # received fragments of an incomplete message
        self._opcode = Opcode.BINARY  # opcode of the last message's first frame

    # --- receiving

    def feed(self, data: bytes) -> None:
        """Add received bytes to the parser's buffer."""
        self._frames.feed(data)

    def next_request(self) -> Request | None:
        """Return the client's request, or None if it is incomplete. Raise ValueError if it is not a request."""
        request = self._frames.next_request()
        if request is None and self._frames.handshake_exc:
            raise ValueError(str(self._frames.handshake_exc.__cause__ or self._frames.handshake_exc))
        return request

    def next_frame(self) -> Frame | None:
        """Return the next complete frame, or None. Count the frame against the client's quota."""
        frame = self._frames.next_frame()
        if frame is not None:
            self.rate.count += 1
        return frame

    def event_of(self, frame: Frame) -> Message | Ping | None:
        """Return the ping in a frame, the message that the frame completes, or None for any other frame."""
        if frame.opcode in (Opcode.TEXT, Opcode.BINARY):
            self._opcode = frame.opcode
        elif frame.opcode is Opcode.PING:
            return Ping(bytes(frame.data))
        elif frame.opcode is not Opcode.CONT:
            return None
        is_text = self._opcode is Opcode.TEXT
        if frame.fin and not self._fragments:
            return Message(is_text, bytes(frame.data))
        self._fragments += frame.data
        if not frame.fin:
            return None
        data = bytes(self._fragments)
        self._fragments.clear()
        return Message(is_text, data)

    @property
    def has_unread(self) -> bool:
        """Return whether some received bytes have not been parsed yet."""
        return bool(self._frames.reader.buffer)

    @property
    def unfinished(self) -> int:
        """Return the size in bytes of incomplete frames and messages."""
        return len(self._frames.reader.buffer) + len(self._fragments)

    def discard_unfinished(self) -> None:
        """Discard the received parts of incomplete frames and messages."""
        self._frames.reader.buffer.clear()
        self._fragments.clear()

    def restrict(self, max_size: int) -> None:
        """From now on, refuse messages larger than ``max_size`` bytes."""
        self._frames.limit(max_size)

    # --- sending

    @property
    def subprotocol(self) -> str | None:
        """Return the sub-protocol that was chosen in the handshake."""
        return self._frames.subprotocol

    @property
    def is_open(self) -> bool:
        """Return whether the handshake is complete and neither side has sent a close frame."""
        return self._frames.state is State.OPEN

    @property
    def is_closed(self) -> bool:
        """Return whether this side has sent a close frame."""
        return self._frames.state in (State.CLOSING, State.CLOSED)

    def response_to(self, request: Request) -> Response:
        """Return the response to a handshake request; its status is 101 if the request is accepted."""
        return self._frames.accept(request)

    def accept(self, response: Response) -> None:
        """Send the response to the handshake request, which opens the WebSocket."""
        self._frames.send_response(response)

    def ping(self, data: bytes) -> None:
        """Queue a ping."""
        self._frames.send_ping(data)

    def close(self, code: int, reason: str) -> None:
        """Queue a close frame. The reason is truncated if necessary."""
        self._frames.send_close(code, reason.encode()[:_MAX_REASON].decode(errors="ignore"))

    def data_to_send(self) -> tuple[bytes, ...]:
        """Remove and return the bytes that are queued for sending."""
        return tuple(piece for piece in self._frames.data_to_send() if piece)


def _select(
    select: Callable[[Sequence[str]], str | None], offered: Sequence[Subprotocol]
) -> Subprotocol | None:
    names = [name for name in offered if not name.startswith(TOKEN_PROTOCOL)]
    return select(names)  # type: ignore[return-value]


# At level DEBUG, the library would log clients' messages and tokens: give it a logger that discards everything below
# CRITICAL.
_QUIET = logging.Logger(__name__, logging.CRITICAL)
