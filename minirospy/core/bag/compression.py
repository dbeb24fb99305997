"""Compress and decompress chunks. Chunk headers name the compression: none, bz2 or lz4, in MCAP files also zstd.

An LZ4 frame is written as ROS's own reader (roslz4) requires: independent blocks of at most 1 MiB, a content
checksum, neither block checksums nor the content size. Every standard frame can be read. lz4 is imported when a chunk
needs it. Sources: http://wiki.ros.org/Bags/Format/2.0, https://github.com/lz4/lz4/blob/dev/doc/lz4_Frame_format.md.
"""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from types import ModuleType
from typing import TypeVar

from minirospy.base.errors import BagCompressionError, BagFormatError
from minirospy.base.installation import install_command

__all__ = [
    "BZ2",
    "COMPRESSIONS",
    "LZ4",
    "MAX_CHUNK_SIZE",
    "NONE",
    "check_compression",
    "compress",
    "decompress",
    "decompress_mcap",
]

NONE = "none"
BZ2 = "bz2"
LZ4 = "lz4"
COMPRESSIONS = (NONE, BZ2, LZ4)  # in the same order as in rosbag

MAX_CHUNK_SIZE = 1088 * 1024 * 1024
"""Maximum size, in bytes, of a compressed chunk's data: the longest message (1 GiB) and the records before it must fit."""

_MAX_LZ4 = 256  # maximum ratio of decompressed to compressed size of an LZ4 block
_MAX_STREAMS = 20_000  # maximum bz2 streams per chunk; parallel compressors write one per 100 kB
_PIECE = 16 * 1024 * 1024  # bytes to decompress per step; Ctrl-C takes effect only between steps
_INPUT = 256 * 1024  # bytes of compressed data to pass to a library per call

Buffer = bytes | bytearray | memoryview
_T = TypeVar("_T")


def check_compression(name: str) -> None:
    """Raise BagCompressionError unless this machine can compress chunks with ``name``."""
    if name not in COMPRESSIONS:
        raise BagCompressionError(name, f"it must be one of: {', '.join(COMPRESSIONS)}")
    if name == LZ4:
        _lz4_frame()


def compress(name: str, data: Buffer) -> bytes:
    """Compress a chunk's data with ``name``. Raise BagCompressionError if that is not possible."""
    return _choose(_COMPRESS, name)(data)


def decompress(name: str, data: bytes, size: int, is_cancelled: Callable[[], bool] = lambda: False) -> bytes:
    """Decompress a chunk's data. The result must have ``size`` bytes.

    Allocates at most ``size`` bytes and one piece. ``is_cancelled`` is polled between pieces, possibly in another
    thread than the caller's. Raise BagFormatError if the data is damaged, if its size is not ``size``, or after a
    cancellation, and BagCompressionError if the compression is unknown or its library is missing.
    """
    return _decompressed(_choose(_DECOMPRESS, name), name, data, size, is_cancelled)


def decompress_mcap(name: str, data: bytes, size: int) -> bytes:
    """Decompress the data of a chunk in an MCAP file. ``name`` is zstd, lz4, or "" for none.

    Raise the same exceptions as :func:`decompress`.
    """
    if not name:
        return data
    return _decompressed(_choose(_DECOMPRESS_MCAP, name), name, data, size, lambda: False)


def _decompressed(
    function: Callable[[bytes, _Output], bytes],
    name: str,
    data: bytes,
    size: int,
    is_cancelled: Callable[[], bool],
) -> bytes:
    if size > MAX_CHUNK_SIZE and name != NONE:
        raise BagFormatError(f"a compressed chunk of {size} bytes: more than {MAX_CHUNK_SIZE} are not read")
    found = function(data, _Output(size, is_cancelled))
    if len(found) != size:
        raise BagFormatError(f"a chunk has {len(found)} bytes instead of {size}")
    return found


def _choose(table: dict[str, _T], name: str) -> _T:
    try:
        return table[name]
    except KeyError:
        raise BagCompressionError(name) from None


def _lz4_frame() -> ModuleType:
    try:
        import lz4.frame  # type: ignore[import-untyped]
    except ImportError as error:
        raise BagCompressionError(LZ4, f"install its library: {install_command('lz4')}") from error
    frame: ModuleType = lz4.frame
    return frame


def _same(data: Buffer) -> bytes:
    return bytes(data)


def _compress_bz2(data: Buffer) -> bytes:
    import bz2

    return bz2.compress(data)


def _compress_lz4(data: Buffer) -> bytes:
    frame = _lz4_frame()
    compressed: bytes = frame.compress(
        data,
        block_size=frame.BLOCKSIZE_MAX1MB,
        block_linked=False,
        content_checksum=True,
        block_checksum=False,
        store_size=False,
    )
    return compressed


class _Output:
    """Collects decompressed data, which must have ``size`` bytes. Raises BagFormatError if there is more.

    Large data is decompressed in pieces, because a library would need twice the memory to join its own pieces, and Ctrl-C
    would have no effect until it finishes.
    """

    def __init__(self, size: int, is_cancelled: Callable[[], bool]) -> None:
        self.size = size
        self._is_cancelled = is_cancelled
        self._first = b""
        self._gathered: BytesIO | None = None
        self._length = 0

    @property
    def room(self) -> int:
        """The number of bytes to request: one more than expected, so that the stream's checksum is reached and verified."""
        return min(self.size - self._length + 1, _PIECE)

    def add(self, piece: bytes) -> None:
        """Add decompressed data. Raise BagFormatError if there is more than expected."""
        self._length += len(piece)
        if self._length > self.size:
            raise BagFormatError(f"a chunk has more than {self.size} bytes")
        if self._is_cancelled():
            raise BagFormatError("the chunk is not needed any more")
        if not self._first:
            self._first = piece
        elif piece:
            if self._gathered is None:
                self._gathered = BytesIO()
                self._gathered.write(self._first)
            self._gathered.write(piece)

    def value(self) -> bytes:
        """Return all data, without a copy."""
        return self._first if self._gathered is None else self._gathered.getvalue()


def _checked(data: bytes, output: _Output) -> bytes:
    return data


def _decompress_bz2(data: bytes, output: _Output) -> bytes:
    import bz2

    view, streams = memoryview(data), 0
    stream: bz2.BZ2Decompressor | None = None
    # Pass the data in parts: each stream copies the data after it, which is slow for a million short streams.
    for start in range(0, len(data), _INPUT):
        part: Buffer = view[start : start + _INPUT]
        while part:
            if stream is None:
                stream = bz2.BZ2Decompressor()
                streams += 1
                if streams > _MAX_STREAMS:
                    raise BagFormatError(f"a chunk has more than {_MAX_STREAMS} bz2 streams")
            try:
                output.add(stream.decompress(part, output.room))
                while not stream.eof and not stream.needs_input:
                    output.add(stream.decompress(b"", output.room))
            except (OSError, ValueError, EOFError) as error:
                raise BagFormatError(f"a chunk's bz2 stream is damaged: {error}") from error
            part = b""
            if stream.eof:
                part, stream = stream.unused_data, None
    if stream is not None:
        raise BagFormatError("a chunk's bz2 stream is truncated")
    return output.value()


def _decompress_lz4(data: bytes, output: _Output) -> bytes:
    if output.size > len(data) * _MAX_LZ4:
        # Check the size first: the library allocates that much before it reads the data.
        raise BagFormatError(f"a chunk's {output.size} bytes cannot be in {len(data)} bytes of LZ4")
    stream = _lz4_frame().LZ4FrameDecompressor()
    # Pass the data in parts, because the library copies the remaining data each time.
    for start in range(0, len(data), _INPUT):
        part = data[start : start + _INPUT]
        while part or not (stream.eof or stream.needs_input):
            try:
                piece: bytes = stream.decompress(part, output.room)
            except (RuntimeError, ValueError, MemoryError) as error:
                raise BagFormatError(f"a chunk's LZ4 frame is damaged: {error}") from error
            if not piece and not part:
                break
            output.add(piece)
            part = b""
        if stream.eof:
            return output.value()
    raise BagFormatError("a chunk's LZ4 frame is truncated")


def _decompress_zstd(data: bytes, output: _Output) -> bytes:
    import zstandard

    try:
        with zstandard.ZstdDecompressor().stream_reader(data) as stream:
            while piece := stream.read(output.room):
                output.add(piece)
    except zstandard.ZstdError as error:
        raise BagFormatError(f"a chunk's Zstandard frame is damaged: {error}") from error
    return output.value()


_COMPRESS: dict[str, Callable[[Buffer], bytes]] = {NONE: _same, BZ2: _compress_bz2, LZ4: _compress_lz4}
_DECOMPRESS: dict[str, Callable[[bytes, _Output], bytes]] = {
    NONE: _checked,
    BZ2: _decompress_bz2,
    LZ4: _decompress_lz4,
}
_DECOMPRESS_MCAP: dict[str, Callable[[bytes, _Output], bytes]] = {
    LZ4: _decompress_lz4,
    "zstd": _decompress_zstd,
}
