"""Find the next chunk in a damaged version 2.0 bag, and return its position."""

from __future__ import annotations

from typing import BinaryIO

from minirospy.base.errors import BagFormatError
from minirospy.core.bag import compression, records

__all__ = ["is_record", "next_chunk"]

_BLOCK = 1024 * 1024
_MARK = b"\x04\0\0\0op=\x05"  # the field ``op`` in a chunk's header

# Possible total lengths of the fields that a writer may have put before ``op``: size, compression, or both
_BEFORE = (0, 13, 19, 20, 32, 33)


def is_record(stream: BinaryIO, position: int, limit: int) -> bool:
    """Return whether ``position`` is the start of a record, or the end of the stream (``limit``)."""
    return position == limit or _op(stream, position, limit) in _OPS


def next_chunk(stream: BinaryIO, start: int, limit: int) -> int | None:
    """Return the position of the first complete chunk at or after ``start`` that is followed by its index records, or None.

    A chunk inside a message, for example in a bag that was sent as bytes, cannot be distinguished from the bag's own chunks.
    """
    position = start
    while position < limit:
        stream.seek(position)
        block = stream.read(_BLOCK)
        at = block.find(_MARK)
        while at >= 0:
            for before in _BEFORE:
                candidate = position + at - 4 - before
                if candidate >= start and _is_chunk(stream, candidate, limit):
                    return candidate
            at = block.find(_MARK, at + 1)
        if position + len(block) >= limit:
            return None
        # Let the blocks overlap: the mark may cross the end of a block, and the chunk starts before the mark.
        position += max(len(block) - len(_MARK) - 4 - _BEFORE[-1], 1)
    return None


_OPS = frozenset(
    (
        records.OP_MESSAGE_DATA,
        records.OP_INDEX_DATA,
        records.OP_CHUNK,
        records.OP_CHUNK_INFO,
        records.OP_CONNECTION,
    )
)


def _op(stream: BinaryIO, position: int, limit: int) -> int | None:
    stream.seek(position)
    try:
        return records.read_record(stream, limit).op
    except BagFormatError:
        return None


def _is_chunk(stream: BinaryIO, position: int, limit: int) -> bool:
    stream.seek(position)
    try:
        record = records.read_record(stream, limit)
        chunk = records.parse_chunk_header(record)
    except BagFormatError:
        return False
    if not record.data_size or chunk.compression not in compression.COMPRESSIONS:
        return False
    return record.end == limit or _op(stream, record.end, limit) == records.OP_INDEX_DATA
