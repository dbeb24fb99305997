"""The library ``websockets``' protocol, made to stop after each frame. Source: RFC 6455."""

from __future__ import annotations

from collections.abc import Generator

from websockets.frames import Frame, Opcode
from websockets.http11 import Request
from websockets.server import ServerProtocol
from websockets.streams import StreamReader

__all__ = ["FrameByFrame"]


class FrameByFrame(ServerProtocol):
    """The library's protocol, which parses all that has come in one call, made to stop after each frame."""

    reader: _GatedReader

    def feed(self, data: bytes) -> None:
        """Add bytes that were received."""
        self.reader.feed_data(data)

    def next_request(self) -> Request | None:
        """Return the request, once it has come whole; else None, and ``handshake_exc`` is set if it is not one."""
        next(self.parser)
        events = self.events_received()
        return events[0] if events and isinstance(events[0], Request) else None

    def next_frame(self) -> Frame | None:
        """Return the next frame that has come whole, None if there is none."""
        self.reader.is_open = True
        next(self.parser)
        event = self.events.pop() if self.events else None
        return event if isinstance(event, Frame) else None

    def limit(self, size: int) -> None:
        """Refuse larger messages from now on."""
        # The name of the attribute depends on the library's release.
        for name in ("max_message_size", "max_size"):
            if hasattr(self, name):
                setattr(self, name, size)

    def parse(self) -> Generator[None]:
        """See the library's: called once, before anything is read."""
        self.reader = _GatedReader()
        yield from super().parse()

    def recv_frame(self, frame: Frame) -> None:
        """Take over a frame, and stop; pings are answered by the connection."""
        if frame.opcode is Opcode.PING:
            self.events.append(frame)
        else:
            super().recv_frame(frame)
        self.reader.is_open = False


class _GatedReader(StreamReader):
    """Stops the parser before each frame while it is not open."""

    is_open = False

    def at_eof(self) -> Generator[None, None, bool]:
        """See the library's: called by the parser before each frame. The end of the stream is the pipe's."""
        while not (self.is_open and self.buffer):
            yield
        return False
