"""Build bags of any shape, record by record. The test chooses the messages of each chunk and their order."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from minirospy.core.bag.compression import compress
from minirospy.core.bag.encoding import (
    encode_bag_header,
    encode_chunk_header,
    encode_chunk_info,
    encode_connection,
    encode_index_data,
    message_prefixes,
)
from minirospy.core.bag.records import MAGIC, BagHeader, Chunk, ChunkInfo, Connection, Record

_TIME_AND_SIZE = struct.Struct("<III")  # the end of a message's header, and the size of its body
_ENTRY = struct.Struct("<III")
STRING = "string data\n"
STRING_MD5 = "992ce8a1687cec8c8bd883ec73ca41d1"


class Given(NamedTuple):
    """A message to write to a bag."""

    connection: int
    time: int
    body: bytes


def connection(number: int, topic: str = "", **header: str) -> Connection:
    """Return a connection with std_msgs/String, unless ``header`` has other fields."""
    topic = topic or f"/topic{number}"
    fields = {
        "topic": topic,
        "type": "std_msgs/String",
        "md5sum": STRING_MD5,
        "message_definition": STRING,
    } | header
    return Connection(number, topic, {name: value.encode() for name, value in fields.items()})


def make_bag(
    chunks: Iterable[Sequence[Given]],
    connections: Sequence[Connection] = (connection(0), connection(1), connection(2)),
    *,
    compression: str = "none",
    layout: int = 0,
    closed: bool = True,
) -> bytes:
    """Return a bag whose chunks have these messages; ``layout`` 1 orders the fields as C++ does."""
    parts = [MAGIC, encode_bag_header(BagHeader(0, 0, 0))]
    position = sum(map(len, parts))
    by_id = {each.id: each for each in connections}
    stored: dict[int, Connection] = {}
    infos = []
    for messages in chunks:
        data = b""
        entries: dict[int, list[tuple[int, int]]] = {}
        for number, time, body in messages:
            if number not in stored:
                stored[number] = by_id[number]
                data += encode_connection(by_id[number])
            entries.setdefault(number, []).append((time, len(data)))
            data += (
                message_prefixes(number)[layout] + _TIME_AND_SIZE.pack(*divmod(time, 10**9), len(body)) + body
            )

        packed = compress(compression, data)
        header = encode_chunk_header(Chunk(compression, len(data), len(packed)))
        index = b"".join(encode_index_data(number, sorted(each)) for number, each in entries.items())
        parts += [header, packed, index]
        times = [message.time for message in messages]
        counts = {number: len(each) for number, each in entries.items()}
        infos.append(ChunkInfo(position, min(times), max(times), counts))
        position += len(header) + len(packed) + len(index)

    if closed:
        parts[1] = encode_bag_header(BagHeader(position, len(stored), len(infos)))
        parts += [encode_connection(each) for each in stored.values()]
        parts += [encode_chunk_info(info) for info in infos]
    return b"".join(parts)


class Index(NamedTuple):
    """One connection's index of a chunk: pairs of time and offset."""

    connection: int
    entries: list[tuple[int, int]]


def parse_index(record: Record, data: bytes) -> Index:
    """Parse an index record and its data."""
    assert record.uint32("ver") == 1
    entries = [
        (seconds * 10**9 + nanoseconds, offset) for seconds, nanoseconds, offset in _ENTRY.iter_unpack(data)
    ]
    assert record.uint32("count") == len(entries)
    return Index(record.uint32("conn"), entries)
