"""Message classes whose messages are the bytes as they came, for recording and playing."""

from __future__ import annotations

from minirospy.client.topics import AnyMsg
from minirospy.core.idl.protocols import Buffer
from minirospy.core.wire.framing import SplitFrame

__all__ = ["ReceivedFrame", "frame_class", "parts_of"]


class ReceivedFrame(AnyMsg):
    """A message of any type as it came: ``frame`` is valid during the callback only, unless it is ``bytes``."""

    __slots__ = ["frame"]
    frame: Buffer

    def deserialize(self, str: Buffer) -> ReceivedFrame:
        """Take the bytes, without a copy."""
        self.frame = str
        return self


def parts_of(frame: Buffer) -> tuple[Buffer, bytes]:
    """Return the bytes of a frame in two parts; the second is that of a large message which came in two, else empty."""
    if isinstance(frame, SplitFrame):
        # A view of it sees the first part alone.
        return memoryview(frame), frame.tail
    return frame, b""


def frame_class(type_: str, md5sum: str, definition: str) -> type[AnyMsg]:
    """Return a class of messages of this type that are published from their bytes, ``_buff``."""
    fields = {"_type": type_, "_md5sum": md5sum, "_full_text": definition, "__slots__": []}
    return type("StoredFrame", (AnyMsg,), fields)
