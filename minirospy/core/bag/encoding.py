"""Serialize bag records from named tuples to bytes.

Fields are in the same order as in rosbag's Python writer. Source: http://wiki.ros.org/Bags/Format/2.0.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence

from minirospy.base.errors import BagFormatError
from minirospy.core.bag.records import (
    BAG_HEADER_SIZE,
    MAX_UINT32,
    OP_BAG_HEADER,
    OP_CHUNK,
    OP_CHUNK_INFO,
    OP_CONNECTION,
    OP_INDEX_DATA,
    BagHeader,
    Chunk,
    ChunkInfo,
    Connection,
)

__all__ = [
    "encode_bag_header",
    "encode_chunk_header",
    "encode_chunk_info",
    "encode_connection",
    "encode_fields",
    "encode_index_data",
    "message_prefix",
    "message_prefixes",
]

_BILLION = 10**9
_UINT32 = struct.Struct("<I")
_UINT64 = struct.Struct("<Q")
_TIME = struct.Struct("<II")
_PAIR = struct.Struct("<II")
_ENTRY = struct.Struct("<III")


def message_prefix(connection: int) -> bytes:
    """Return the 34 bytes before a message's time. They are the same for all messages on a connection.

    The prefix is followed by seconds, nanoseconds and the body's size, 32 bits each, then the body.
    """
    return b"\x26\0\0\0\x04\0\0\0op=\x02\x09\0\0\0conn=" + _UINT32.pack(connection) + b"\x0d\0\0\0time="


def message_prefixes(connection: int) -> tuple[bytes, bytes]:
    """Return two variants of :func:`message_prefix`: the Python writer's, and the C++ writer's with sorted fields.

    A reader recognizes nearly every message by comparing it with these two; :func:`parse_record` parses the others.
    """
    number = _UINT32.pack(connection)
    return (
        message_prefix(connection),
        b"\x26\0\0\0\x09\0\0\0conn=" + number + b"\x04\0\0\0op=\x02\x0d\0\0\0time=",
    )


def encode_fields(fields: Mapping[str, bytes]) -> bytes:
    """Serialize a header, including its length prefix. The fields keep the mapping's order."""
    parts = [b""]
    for name, value in fields.items():
        field = name.encode() + b"=" + value
        parts += (_UINT32.pack(len(field)), field)
    parts[0] = _UINT32.pack(sum(map(len, parts)))
    return b"".join(parts)


def encode_bag_header(header: BagHeader) -> bytes:
    """Serialize the bag header record, padded to its constant size."""
    fields = encode_fields(
        {
            "op": bytes((OP_BAG_HEADER,)),
            "index_pos": _UINT64.pack(header.index_pos),
            "conn_count": _UINT32.pack(header.connection_count),
            "chunk_count": _UINT32.pack(header.chunk_count),
        }
    )
    padding = BAG_HEADER_SIZE - (len(fields) - 4)
    return fields + _UINT32.pack(padding) + b" " * padding


def encode_chunk_header(chunk: Chunk) -> bytes:
    """Serialize a chunk's header and the length of its data. Raise BagFormatError if the data exceeds 4 GiB."""
    if max(chunk.size, chunk.compressed_size) > MAX_UINT32:
        raise BagFormatError(f"a chunk of {chunk.size} bytes is larger than the format allows, 4 GiB")
    fields = {
        "op": bytes((OP_CHUNK,)),
        "compression": chunk.compression.encode(),
        "size": _UINT32.pack(chunk.size),
    }
    return encode_fields(fields) + _UINT32.pack(chunk.compressed_size)


def encode_connection(connection: Connection) -> bytes:
    """Serialize a connection record."""
    fields = {
        "op": bytes((OP_CONNECTION,)),
        "topic": connection.topic.encode(),
        "conn": _UINT32.pack(connection.id),
    }
    return encode_fields(fields) + encode_fields(connection.header)


def encode_index_data(connection: int, entries: Sequence[tuple[int, int]]) -> bytes:
    """Serialize one connection's index record for the preceding chunk: pairs of time and offset, in time order."""
    fields = {
        "op": bytes((OP_INDEX_DATA,)),
        "conn": _UINT32.pack(connection),
        "ver": _UINT32.pack(1),
        "count": _UINT32.pack(len(entries)),
    }
    data = b"".join(_ENTRY.pack(*divmod(time, _BILLION), offset) for time, offset in entries)
    return _encode_record(fields, data)


def encode_chunk_info(info: ChunkInfo) -> bytes:
    """Serialize a chunk info record."""
    fields = {
        "op": bytes((OP_CHUNK_INFO,)),
        "ver": _UINT32.pack(1),
        "chunk_pos": _UINT64.pack(info.position),
        "start_time": _TIME.pack(*divmod(info.start_time, _BILLION)),
        "end_time": _TIME.pack(*divmod(info.end_time, _BILLION)),
        "count": _UINT32.pack(len(info.counts)),
    }
    return _encode_record(fields, _encode_pairs(info.counts.items()))


def _encode_pairs(pairs: Iterable[tuple[int, int]]) -> bytes:
    return b"".join(_PAIR.pack(*pair) for pair in pairs)


def _encode_record(fields: Mapping[str, bytes], data: bytes) -> bytes:
    return encode_fields(fields) + _UINT32.pack(len(data)) + data
