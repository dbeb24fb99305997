"""Where the records of a damaged bag of version 2.0 go on: a stream in, the position of its next chunk out."""

from __future__ import annotations

from typing import BinaryIO

from minirospy.base.errors import BagFormatError
from minirospy.core.bag import compression, records

__all__ = ["is_record", "next_chunk"]

_BLOCK = 1024 * 1024
_MARK = b"\x04\0\0\0op=\x05"
"""The field of a chunk's header that names it a chunk."""

_BEFORE = (0, 13, 19, 20, 32, 33)
"""Bytes of the other fields, size and compression, that a writer may have put in front of it."""


def is_record(stream: BinaryIO, position: int, limit: int) -> bool:
    """Return whether a record is at a position, or the stream's end, which is ``limit``."""
    return position == limit or _op(stream, position, limit) in _OPS


def next_chunk(stream: BinaryIO, start: int, limit: int) -> int | None:
    """Return the position of the first whole chunk from ``start`` on which its index records follow; None without one.

    A chunk that is inside of another one's messages, such as that of a bag that was sent as bytes, cannot be told apart.
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
        # The mark may be on both sides of the border, and the header's start before it.
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
