"""Message classes that keep the serialized bytes unchanged, for recording and playing."""

from __future__ import annotations

from minirospy.client.topics import AnyMsg
from minirospy.core.idl.protocols import Buffer
from minirospy.core.wire.framing import SplitFrame

__all__ = ["ReceivedFrame", "frame_class", "parts_of"]


class ReceivedFrame(AnyMsg):
    """A received message of any type, not deserialized.

    ``frame`` contains its bytes, valid only during the callback unless ``frame`` is ``bytes``.
    """

    _takes_memoryview = True
    _takes_split_frames = True
    __slots__ = ["frame"]
    frame: Buffer

    def deserialize(self, str: Buffer) -> ReceivedFrame:
        """Store the bytes without copying them."""
        self.frame = str
        return self


def parts_of(frame: Buffer) -> tuple[Buffer, ...]:
    """Return the parts in which a frame was received: one, or three if it is a split frame."""
    if isinstance(frame, SplitFrame):
        # A memoryview of the frame contains only the first part.
        return memoryview(frame), frame.array, frame.rest
    return (frame,)


def frame_class(type_: str, md5sum: str, definition: str) -> type[AnyMsg]:
    """Return a class for publishing messages of this type that are already serialized; ``_buff`` holds the bytes."""
    fields = {"_type": type_, "_md5sum": md5sum, "_full_text": definition, "__slots__": []}
    return type("StoredFrame", (AnyMsg,), fields)
