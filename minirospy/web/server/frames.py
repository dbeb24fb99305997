"""The library ``websockets``' protocol class, modified to stop after each frame. Source: RFC 6455."""

from __future__ import annotations

from collections.abc import Generator

from websockets.frames import Frame, Opcode
from websockets.http11 import Request
from websockets.server import ServerProtocol
from websockets.streams import StreamReader

__all__ = ["FrameByFrame"]


class FrameByFrame(ServerProtocol):
    """The WebSocket library's protocol, except that it parses one frame per call, not all received data."""

    reader: _GatedReader

    def feed(self, data: bytes) -> None:
        """Add received bytes to the parser's buffer."""
        self.reader.feed_data(data)

    def next_request(self) -> Request | None:
        """Return the request, or None if it is incomplete. If the data is not a request, set ``handshake_exc``."""
        next(self.parser)
        events = self.events_received()
        return events[0] if events and isinstance(events[0], Request) else None

    def next_frame(self) -> Frame | None:
        """Return the next frame, or None if it is incomplete."""
        self.reader.is_open = True
        next(self.parser)
        event = self.events.pop() if self.events else None
        return event if isinstance(event, Frame) else None

    def limit(self, size: int) -> None:
        """From now on, refuse messages larger than ``size`` bytes."""
        # The attribute has another name in some versions of the library.
        for name in ("max_message_size", "max_size"):
            if hasattr(self, name):
                setattr(self, name, size)

    def parse(self) -> Generator[None]:
        """See the library's method. Called once, before any data arrives."""
        self.reader = _GatedReader()
        yield from super().parse()

    def recv_frame(self, frame: Frame) -> None:
        """Process a frame, then stop the parser. The connection itself responds to pings."""
        if frame.opcode is Opcode.PING:
            self.events.append(frame)
        else:
            super().recv_frame(frame)
        self.reader.is_open = False


class _GatedReader(StreamReader):
    """Stops the parser before each frame unless ``is_open`` is set."""

    is_open = False

    def at_eof(self) -> Generator[None, None, bool]:
        """See the library's method, called by its parser before each frame. The pipe itself detects the end of the stream."""
        while not (self.is_open and self.buffer):
            yield
        return False
