"""Frames: a 4-byte little-endian length, then that many bytes, as TCPROS sends every message.

The reader owns the buffer that a socket receives into, so that bytes are moved once:
``n = sock.recv_into(reader.space()); for frame in reader.received(n): ...``
Source: http://wiki.ros.org/ROS/TCPROS.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from minirospy.errors import WireError

__all__ = ["CHUNK", "MAX_FRAME", "FrameReader", "serialize_frame"]

CHUNK = 64 * 1024
"""Bytes that one receive asks for while messages are small."""

MAX_FRAME = 1024 * 1024 * 1024
"""A longer frame is refused: it is garbage, or not for us."""

_FIRST_CLAIM = 16 * 1024 * 1024
_LENGTH = struct.Struct("<I")


def serialize_frame(body: bytes) -> bytes:
    """``body`` with its length in front."""
    return _LENGTH.pack(len(body)) + body


class FrameReader:
    """Bytes in, frames out.

    A frame is a memoryview that is valid until the next call of :meth:`space`, except that a frame longer
    than CHUNK comes in a buffer of its own, which nobody writes again.
    """

    def __init__(self, limit: int = MAX_FRAME) -> None:
        self._limit = limit
        self._small = memoryview(bytearray(CHUNK))
        self._start = 0
        self._end = 0
        self._large: bytearray | None = None
        self._filled = 0
        self._wanted = 0

    def space(self) -> memoryview:
        """Where the next bytes go; never empty."""
        if self._large is not None:
            if self._filled == len(self._large):
                # A length is only a claim until the bytes come: memory grows with what has come.
                grown = bytearray(min(self._wanted, 2 * len(self._large)))
                grown[: self._filled] = self._large
                self._large = grown
            return memoryview(self._large)[self._filled :]
        if self._start:
            rest = self._end - self._start
            self._small[:rest] = self._small[self._start : self._end]
            self._start, self._end = 0, rest
        return self._small[self._end :]

    def received(self, count: int) -> Iterator[memoryview]:
        """The frames that are complete after ``count`` more bytes in :meth:`space`. Raises WireError."""
        if self._large is not None:
            self._filled += count
            if self._filled == self._wanted:
                frame, self._large = memoryview(self._large), None
                yield frame
            return
        self._end += count
        small, unpack, end = self._small, _LENGTH.unpack_from, self._end
        at = self._start
        while end - at >= 4:
            (length,) = unpack(small, at)
            stop = at + 4 + length
            if stop > end:
                if length > CHUNK - 4:
                    self._begin_large(length, at + 4)
                    return
                break
            self._start = stop
            yield small[at + 4 : stop]
            at = stop
        if at == end:
            self._start = self._end = 0

    def _begin_large(self, length: int, at: int) -> None:
        if length > self._limit:
            raise WireError(f"a message of {length} bytes is over the limit of {self._limit}")
        self._large = bytearray(min(length, _FIRST_CLAIM))
        self._filled = self._end - at
        self._wanted = length
        self._large[: self._filled] = self._small[at : self._end]
        self._start = self._end = 0
