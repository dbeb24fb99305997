"""Frames: a 4-byte little-endian length, then that many bytes. TCPROS sends every message as a frame.

The reader owns the buffer that a socket receives into, so that bytes are copied only once:
``n = sock.recv_into(reader.space()); for frame in reader.received(n): ...``

If a subscriber's header has ``split_frames=2``, a large message is sent as a split frame if its class declares a byte array
as its last field of variable length: the length with its highest bit set, 4 bytes with the array's size, 4 bytes with the
size of the fields after it, then the unchanged message. The subscriber can then read the array into a separate object,
which becomes the field without another copy.
Source: http://wiki.ros.org/ROS/TCPROS, docs/transports.md.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any, NamedTuple, SupportsIndex, overload

from minirospy.base.errors import WireError

__all__ = [
    "CHUNK",
    "LENGTH_BYTES",
    "MAX_FRAME",
    "SPLIT",
    "SPLIT_BYTES",
    "Frame",
    "FrameReader",
    "LargeFrame",
    "Pieces",
    "SplitFrame",
    "check_split",
    "may_split",
    "parse_length",
    "parse_split",
    "serialize_frame",
    "split_frame",
]

CHUNK = 64 * 1024  # bytes to receive per call while messages are small

LENGTH_BYTES = 4  # bytes in the length prefix of a frame or connection header

MAX_FRAME = 1024 * 1024 * 1024  # maximum bytes in a frame; a longer one is rejected as invalid

SPLIT = 1 << 31  # flag bit in the length field: the size of the array and of the fields after it follow
SPLIT_BYTES = 8  # bytes in these two sizes

FIRST_CLAIM = 16 * 1024 * 1024
_LENGTH = struct.Struct("<I")
_TWO_LENGTHS = struct.Struct("<II")
_THREE_LENGTHS = struct.Struct("<III")


def serialize_frame(body: bytes) -> bytes:
    """Return ``body`` with its length prefix."""
    return _LENGTH.pack(len(body)) + body


def parse_length(data: bytes) -> int:
    """Parse the length in the first :data:`LENGTH_BYTES` of ``data``."""
    return int.from_bytes(data[:LENGTH_BYTES], "little")


class LargeFrame(NamedTuple):
    """A message to send in pieces that are too large to be joined: the pieces, in order, and their total size.

    ``array``: the size of the second piece if it is a byte array at which the frame may be split, else 0.
    """

    pieces: tuple[bytes, ...]
    size: int
    array: int = 0

    @property
    def rest(self) -> int:
        """The number of bytes after the array, or 0 if the frame must not be split."""
        return self.size - len(self.pieces[0]) - self.array if self.array else 0

    def buffers(self, *, split: bool) -> list[bytes]:
        """Return the buffers to send: a split frame if ``split`` is set and this message can be split, else a normal frame."""
        if split and self.array:
            first, *others = self.pieces
            return [_THREE_LENGTHS.pack(self.size | SPLIT, self.array, self.rest) + first, *others]
        return [_LENGTH.pack(self.size), *self.pieces]


class Pieces(list[Any]):
    """The target for a message's ``serialize``; joins small byte strings, and keeps large ones separate."""

    __slots__ = ()
    write = list.append

    def frame(self, after_array: int | None = None) -> bytes | LargeFrame:
        """Return all bytes written, as one frame.

        ``after_array``: the message class's number of bytes after its last byte array, as declared by
        :func:`minirospy.core.idl.codec.bytes_after_array`.
        """
        size = len(self[0]) if len(self) == 1 else sum(map(len, self))
        if size < CHUNK:
            self.insert(0, _LENGTH.pack(size))
            frame = b"".join(self)
            if len(frame) == size + 4:
                return frame
            # Compute the size from the joined pieces: len() of an array.array is not its number of bytes.
            return serialize_frame(frame[4:])

        joined: list[bytes] = []
        small: list[bytes] = []
        for piece in self:
            # Copy any type except bytes, because the caller may change the data before it is sent.
            whole = piece if type(piece) is bytes else bytes(piece)
            if len(whole) < CHUNK:
                small.append(whole)
            else:
                joined += [b"".join(small), whole] if small else [whole]
                small = []

        if small:
            joined.append(b"".join(small))
        size = sum(map(len, joined))
        # The class writes the array, and then the fields after it, if there are any, together. Compare identity, because
        # an earlier number may happen to equal the size of other pieces that were joined.
        has_rest = bool(after_array)
        may_be_split = (
            after_array is not None and len(joined) == 2 + has_rest and joined[1] is self[-1 - has_rest]
        )
        array = len(joined[1]) if may_be_split and may_split(joined[0], len(joined[1])) else 0
        return LargeFrame(tuple(joined), size, array)


class SplitFrame(bytes):
    """A message in three parts, for ``deserialize``: the bytes before its array, those of ``array``, and ``rest``.

    Its length and slices are those of the whole message; the slice that equals ``array`` is that object, without a copy.
    ``bytes(frame)`` joins the parts. A memoryview contains only the first part.
    """

    array: bytes
    rest: bytes

    def __new__(cls, head: bytes, array: bytes, rest: bytes = b"") -> SplitFrame:
        frame = super().__new__(cls, head)
        frame.array = array
        frame.rest = rest
        return frame

    def __len__(self) -> int:
        return super().__len__() + len(self.array) + len(self.rest)

    def __bytes__(self) -> bytes:
        return b"".join((super().__getitem__(slice(None)), self.array, self.rest))

    @overload
    def __getitem__(self, key: SupportsIndex) -> int: ...

    @overload
    def __getitem__(self, key: slice) -> bytes: ...

    def __getitem__(self, key: SupportsIndex | slice) -> int | bytes:
        if isinstance(key, slice):
            start, stop, step = key.indices(len(self))
            if step == 1:
                head = super().__len__()
                rest = head + len(self.array)
                stop = max(start, stop)
                if start >= rest:
                    return self.rest[start - rest : stop - rest]
                if start >= head and stop <= rest:
                    return self.array[start - head : stop - head]
                if stop <= head:
                    return super().__getitem__(slice(start, stop))
        return bytes(self)[key]


Frame = memoryview | bytes  # a message's bytes as delivered


def may_split(head: bytes, array: int) -> bool:
    """Return whether ``head`` ends with the length of a byte array of ``array`` bytes, which is large enough to split off."""
    return array >= CHUNK and len(head) >= 4 and int.from_bytes(head[-4:], "little") == array


def split_frame(head: bytes, array: bytes, rest: bytes = b"") -> SplitFrame:
    """Return the frame of a received message. Raise WireError if ``head`` does not end with the array's length."""
    if not may_split(head, len(array)):
        raise WireError("a split message was not split where its array begins")
    return SplitFrame(head, array, rest)


def parse_split(data: bytes) -> tuple[int, int]:
    """Return (bytes in the array, bytes after it) from the first :data:`SPLIT_BYTES` bytes after a split frame's length."""
    array, rest = _TWO_LENGTHS.unpack(data)
    return array, rest


def check_split(size: int, array: int, rest: int) -> int:
    """Return the number of bytes before the array of a split frame. Raise WireError if the sizes are inconsistent."""
    if array < CHUNK or size - array - rest < LENGTH_BYTES:
        raise WireError(
            f"a split message of {size} bytes says that it has an array of {array}, followed by {rest} bytes"
        )
    return size - array - rest


class FrameReader:
    """A parser that splits received bytes into frames.

    A frame is a memoryview that is valid until the next call to :meth:`space`, except that a frame longer
    than ``chunk`` gets a separate buffer, which is not reused. With ``gathers`` false the caller must read such a frame
    itself: :attr:`unfinished` contains its first bytes. A frame of more than ``limit`` bytes raises WireError, or with
    ``skips`` is skipped and counted in :attr:`skipped`.
    """

    def __init__(
        self, limit: int = MAX_FRAME, *, gathers: bool = True, skips: bool = False, chunk: int = CHUNK
    ) -> None:
        self.skipped = 0  # number of skipped frames
        self.unfinished: tuple[int, bytes] | None = None
        """The length of a large frame and its first bytes. The caller resets this to None."""
        self._gathers = gathers
        self._limit = limit
        self._skips = skips
        self._chunk = chunk
        self._small = memoryview(bytearray(chunk))
        self._start = 0
        self._end = 0
        self._large: bytearray | None = None
        # The number of bytes received of the large frame, and the frame's total size.
        self._filled: int
        self._wanted = 0
        # The number of bytes of a skipped frame that are still to be received.
        self._left_out = 0

    @property
    def wanted(self) -> int:
        """The size of the current large frame, or of the last one."""
        return self._wanted

    def put_back(self, data: bytes) -> None:
        """Store ``data``, which must be short, as the first received bytes; the buffer must be empty."""
        self._end = len(data)
        self._small[: self._end] = data

    def space(self) -> memoryview:
        """Return the buffer into which to read the next bytes. Its length is never zero."""
        if self._large is not None:
            if self._filled == len(self._large):
                # Let the buffer grow as bytes arrive, because a length prefix alone must not allocate all of the memory.
                grown = bytearray(min(self._wanted, 2 * len(self._large)))
                grown[: self._filled] = self._large
                self._large = grown
            return memoryview(self._large)[self._filled :]
        if self._left_out:
            return self._small[: self._left_out]
        if self._start:
            rest = self._end - self._start
            self._small[:rest] = self._small[self._start : self._end]
            self._start, self._end = 0, rest
        return self._small[self._end :]

    def received(self, count: int) -> Iterator[memoryview]:
        """Process ``count`` bytes in :meth:`space`; return the completed frames. Raise WireError if a frame is too long."""
        if self._large is not None:
            self._filled += count
            if self._filled == self._wanted:
                frame, self._large = memoryview(self._large), None
                yield frame
            return
        if self._left_out:
            self._left_out -= count
            return

        self._end += count
        small, unpack, end = self._small, _LENGTH.unpack_from, self._end
        at = self._start

        while end - at >= 4:
            (length,) = unpack(small, at)
            stop = at + 4 + length
            if stop > end:
                if length > self._chunk - 4:
                    if self._gathers:
                        self._begin_large(length, at + 4)
                    else:
                        self.unfinished = length, bytes(small[at + 4 : end])
                        self._start = self._end = 0
                    return
                break
            self._start = stop
            yield small[at + 4 : stop]
            at = stop

        if at == end:
            self._start = self._end = 0

    def _begin_large(self, length: int, at: int) -> None:
        if length > self._limit and self._skips:
            self.skipped += 1
            self._left_out = length - (self._end - at)
            self._start = self._end = 0
            return
        if length > self._limit:
            raise WireError(f"a message of {length} bytes is over the limit of {self._limit}")
        self._wanted = length
        self._large = bytearray(min(length, FIRST_CLAIM))
        self._filled = self._end - at
        self._large[: self._filled] = self._small[at : self._end]
        self._start = self._end = 0
