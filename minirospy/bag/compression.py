"""Compression of chunks: bytes in, bytes out, by the name that a chunk's header has (none, bz2, lz4).

An LZ4 frame is written as ROS's own reader (roslz4) requires: independent blocks of at most 1 MiB, a checksum of the
content, neither checksums of blocks nor the content's size. Every standard frame is read. lz4 is imported when a chunk
needs it. Sources: http://wiki.ros.org/Bags/Format/2.0, https://github.com/lz4/lz4/blob/dev/doc/lz4_Frame_format.md.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import TypeVar

from minirospy.errors import BagCompressionError, BagFormatError
from minirospy.installation import install_command

__all__ = ["BZ2", "COMPRESSIONS", "LZ4", "NONE", "check_compression", "compress", "decompress"]

NONE = "none"
BZ2 = "bz2"
LZ4 = "lz4"
COMPRESSIONS = (NONE, BZ2, LZ4)
"""The names of the compressions, in the order in which rosbag lists them."""

_MOST_LZ4 = 256
"""How many times as long as its LZ4 block data can be."""

Buffer = bytes | bytearray | memoryview
_T = TypeVar("_T")


def check_compression(name: str) -> None:
    """Raise BagCompressionError unless chunks can be compressed by ``name`` on this machine."""
    if name not in COMPRESSIONS:
        raise BagCompressionError(name, f"it must be one of: {', '.join(COMPRESSIONS)}")
    if name == LZ4:
        _lz4_frame()


def compress(name: str, data: Buffer) -> bytes:
    """Return a chunk's data compressed by ``name``. Raise BagCompressionError."""
    return _choose(_COMPRESS, name)(data)


def decompress(name: str, data: bytes, size: int) -> bytes:
    """Return a chunk's data, which must have ``size`` bytes once it is decompressed.

    Never more than ``size`` bytes are allocated. Raise BagFormatError if the data is damaged or has another size,
    BagCompressionError if the compression is unknown or its library is missing.
    """
    found = _choose(_DECOMPRESS, name)(data, size)
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


def _checked(data: bytes, size: int) -> bytes:
    return data


def _decompress_bz2(data: bytes, size: int) -> bytes:
    import bz2

    found = b""
    while data:
        stream = bz2.BZ2Decompressor()
        try:
            # One byte more than is expected, so that the stream's end is seen and its checksum is compared.
            found += stream.decompress(data, size - len(found) + 1)
        except (OSError, ValueError, EOFError) as error:
            raise BagFormatError(f"a chunk's bz2 stream is damaged: {error}") from error
        if len(found) > size:
            raise BagFormatError(f"a chunk has more than {size} bytes")
        if not stream.eof:
            raise BagFormatError("a chunk's bz2 stream is truncated")
        data = stream.unused_data
    return found


def _decompress_lz4(data: bytes, size: int) -> bytes:
    if size > len(data) * _MOST_LZ4:
        # The library allocates what is expected before it looks at the data.
        raise BagFormatError(f"a chunk's {size} bytes cannot be in {len(data)} bytes of LZ4")
    stream = _lz4_frame().LZ4FrameDecompressor()
    try:
        found: bytes = stream.decompress(data, size + 1)
    except (RuntimeError, ValueError, MemoryError) as error:
        raise BagFormatError(f"a chunk's LZ4 frame is damaged: {error}") from error
    if len(found) > size:
        raise BagFormatError(f"a chunk has more than {size} bytes")
    if not stream.eof:
        raise BagFormatError("a chunk's LZ4 frame is truncated")
    return found


_COMPRESS: dict[str, Callable[[Buffer], bytes]] = {NONE: _same, BZ2: _compress_bz2, LZ4: _compress_lz4}
_DECOMPRESS: dict[str, Callable[[bytes, int], bytes]] = {
    NONE: _checked,
    BZ2: _decompress_bz2,
    LZ4: _decompress_lz4,
}
