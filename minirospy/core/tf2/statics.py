"""Combine static transforms from many publishers in one latched message. Pure.

A publisher latches only its last message, and the bridge is a single publisher that represents all publishers on the
other side. Therefore it publishes the newest transform of each frame, as a static transform broadcaster does.
"""

from __future__ import annotations

import struct

from minirospy.base.errors import DeserializationError

__all__ = ["MAX_BYTES", "MAX_FRAMES", "TF_TYPES", "StaticTransforms"]

TF_TYPES = ("tf2_msgs/TFMessage", "tf/tfMessage")

_LENGTH = struct.Struct("<I")
_STAMP = 12
_NUMBERS = 56  # sizes in bytes: a header's sequence number and time; a translation and rotation
MAX_FRAMES = 10_000
MAX_BYTES = 8 << 20


class StaticTransforms:
    """Stores the newest transform of each frame as bytes: at most :data:`MAX_FRAMES` frames, :data:`MAX_BYTES` in total."""

    def __init__(self) -> None:
        self.left_out = 0  # number of transforms omitted because they exceed a limit
        self._by_child: dict[bytes, bytes] = {}
        self._bytes = 0

    def merged(self, data: bytes | memoryview) -> bytes:
        """Return a ROS 1 message with all transforms so far, including those in ``data``.

        Raise DeserializationError if the bytes are not a TFMessage.
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
                self._keep(child, data[start:end])
        except (struct.error, OverflowError) as error:  # OverflowError: an offset exceeds 32 bits
            raise DeserializationError("the message ends too early") from error
        return _LENGTH.pack(len(self._by_child)) + b"".join(self._by_child.values())

    def _keep(self, child: bytes, transform: bytes) -> None:
        before = self._by_child.get(child)
        size = self._bytes + len(transform) - (len(before) if before else 0)
        if size > MAX_BYTES or (before is None and len(self._by_child) >= MAX_FRAMES):
            self.left_out += 1
            return
        self._by_child[child] = transform
        self._bytes = size


def _text(data: bytes, start: int) -> tuple[bytes, int]:
    (size,) = _LENGTH.unpack_from(data, start)
    end = start + 4 + size
    return data[start + 4 : end], end
