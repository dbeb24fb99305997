"""Static transforms of many publishers in one latched message. Pure.

A publisher latches its last message only, and the bridge is one publisher for all those of the other side. So it publishes
the newest transform of each frame, as a broadcaster of static transforms does.
"""

from __future__ import annotations

import struct

from minirospy.errors import DeserializationError

__all__ = ["TF_TYPES", "StaticTransforms"]

TF_TYPES = ("tf2_msgs/TFMessage", "tf/tfMessage")

_LENGTH = struct.Struct("<I")
_STAMP = 12
_NUMBERS = 56
"""Bytes of a header's number and time, and of a translation and rotation."""


class StaticTransforms:
    """Keeps the newest transform to each frame, as bytes."""

    def __init__(self) -> None:
        self._by_child: dict[bytes, bytes] = {}

    def merged(self, data: bytes | memoryview) -> bytes:
        """Return a message of ROS 1 with all transforms so far, those of this one included.

        Raise DeserializationError on bytes that are not a TFMessage.
        """
        data = bytes(data)
        try:
            (count,) = _LENGTH.unpack_from(data, 0)
            end = 4
            for _ in range(count):
                start, end = end, end + _STAMP
                _, end = _text(data, end)
                child, end = _text(data, end)
                end += _NUMBERS
                if end > len(data):
                    raise DeserializationError("the message ends too early")
                self._by_child[child] = data[start:end]
        except struct.error as error:
            raise DeserializationError("the message ends too early") from error
        return _LENGTH.pack(len(self._by_child)) + b"".join(self._by_child.values())


def _text(data: bytes, start: int) -> tuple[bytes, int]:
    (size,) = _LENGTH.unpack_from(data, start)
    end = start + 4 + size
    return data[start + 4 : end], end
