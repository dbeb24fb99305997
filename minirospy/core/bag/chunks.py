"""A bag's chunks: headers, decompressed data, and the messages in that data.

Messages are found by scanning a chunk's data, not by its index records: scanning costs no more, and a damaged index
cannot lead to a wrong message. Threads decompress the next chunks in advance, because bz2 and lz4 release the GIL.
"""

from __future__ import annotations

import os
import struct
from array import array
from collections import OrderedDict
from collections.abc import Container, Iterable, Mapping
from typing import TYPE_CHECKING, BinaryIO, NamedTuple, Protocol

from minirospy.base.errors import BagFormatError
from minirospy.core.bag import compression, encoding, records
from minirospy.core.bag.index import read_entries
from minirospy.core.bag.records import Chunk, ChunkInfo, Connection

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future

__all__ = ["ChunkStream", "Found", "StoredChunk", "scan", "scan_into", "size_of"]


class StoredChunk(NamedTuple):
    """A chunk's header, and the position of its data in the file."""

    chunk: Chunk
    data_position: int

    @property
    def end(self) -> int:
        """The position after the chunk, where its index records start."""
        return self.data_position + self.chunk.compressed_size


Found = tuple[int, int, int, int, int]
"""A message in a chunk's data: time, rank of its connection, record offset, and start and end of its body.

These are plain tuples, which sort as rosbag orders messages: by time, then by connection, then by offset.
"""


class Ranks(Protocol):
    """A mapping, such as a dict, from a connection to its rank among the requested connections.

    ``get`` returns None for all others.
    """

    def get(self, number: int, /) -> int | None:
        """Return a connection's rank, or None if it was not requested."""


class _Ahead:
    """A chunk that another thread decompresses in advance."""

    def __init__(self, executor: Executor, chunk: Chunk, data: bytes) -> None:
        self._is_cancelled = False
        self._future: Future[bytes] = executor.submit(
            compression.decompress, chunk.compression, data, chunk.size, lambda: self._is_cancelled
        )

    def result(self) -> bytes:
        """Wait for the thread and return the data. Raise BagFormatError if the data is damaged."""
        return self._future.result()

    def cancel(self) -> None:
        """Ask the thread to stop soon."""
        self._is_cancelled = True
        self._future.cancel()


class ChunkStream:
    """The chunks in a seekable stream, which may grow while it is read."""

    def __init__(self, stream: BinaryIO) -> None:
        self.stream = stream
        self._headers: dict[int, StoredChunk] = {}
        self._ahead: OrderedDict[int, _Ahead] = OrderedDict()
        self._executor: Executor | None = None
        self._compared: set[int] = set()

    def header(self, position: int) -> StoredChunk:
        """Return the header of the chunk at a position. Raise BagFormatError if there is no valid chunk."""
        if position not in self._headers:
            limit = size_of(self.stream)
            if position > limit:
                raise BagFormatError("the position of a chunk is behind the file's end", position)
            self.stream.seek(position)
            record = records.read_record(self.stream, limit)
            self._headers[position] = StoredChunk(records.parse_chunk_header(record), record.data_position)
        return self._headers[position]

    def set_header(self, position: int, header: StoredChunk) -> None:
        """Use this header for the chunk at a position instead of the header in the file."""
        self._headers[position] = header

    def data(self, position: int) -> bytes:
        """Return the decompressed data of the chunk at a position.

        Raise BagFormatError if the chunk is damaged, BagCompressionError if its compression is not supported.
        """
        if ahead := self._ahead.pop(position, None):
            try:
                return ahead.result()
            finally:
                # Cancel the thread, because after Ctrl-C its result is no longer needed.
                ahead.cancel()
        chunk = self.header(position).chunk
        try:
            return compression.decompress(chunk.compression, self._read(position), chunk.size)
        except BagFormatError as error:
            raise BagFormatError(error.why, position) from error

    def pick(
        self, info: ChunkInfo, ranks: Ranks, known: Mapping[int, Connection]
    ) -> tuple[bytes, list[Found]] | None:
        """Return the bodies and locations of a few requested messages in a chunk, without reading the rest of the chunk.

        ``known``: see :func:`scan`. Return None if the caller should scan the chunk, because that is cheaper or an index
        is damaged.
        """
        chunk, data_position = header = self.header(info.position)
        wanted = sum(count for number, count in info.counts.items() if ranks.get(number) is not None)
        if chunk.compression != compression.NONE or wanted * PICK_SIZE > chunk.size:
            return None
        try:
            entries, offsets = self._entries(header, info, ranks)
            if len(entries) != wanted:
                return None
            self._compare(data_position, entries, offsets, known)
            return self._picked(data_position, chunk.size, entries)
        except BagFormatError:
            return None

    def prepare(self, positions: Iterable[int]) -> None:
        """Start decompressing the chunks at these positions; cancel the decompression of all others."""
        wanted = [
            position
            for position in positions
            if (chunk := self.header(position).chunk).compression in (compression.BZ2, compression.LZ4)
            and chunk.size <= _MAX_AHEAD
        ]
        for position in self._ahead.keys() - set(wanted):
            self._ahead.pop(position).cancel()

        for position in wanted:
            if position not in self._ahead:
                chunk, data = self.header(position).chunk, self._read(position)
                self._ahead[position] = _Ahead(self._start(), chunk, data)

    def close(self) -> None:
        """Stop the threads; the stream stays open."""
        while self._ahead:
            self._ahead.popitem()[1].cancel()
        if self._executor is not None:
            self._executor.shutdown(wait=True, cancel_futures=True)
            self._executor = None

    def _read(self, position: int) -> bytes:
        header = self.header(position)
        self.stream.seek(header.data_position)
        data = self.stream.read(header.chunk.compressed_size)
        if len(data) != header.chunk.compressed_size:
            raise BagFormatError(
                f"expecting {header.chunk.compressed_size} bytes, read {len(data)}", header.data_position
            )
        return data

    def _entries(
        self, header: StoredChunk, info: ChunkInfo, ranks: Ranks
    ) -> tuple[list[tuple[int, int, int, int]], list[array[int]]]:
        """Return (offset, time, rank, connection) for each requested message, from a chunk's index records.

        Also return the offsets of all messages, in one array per index record.
        """
        limit = size_of(self.stream)
        self.stream.seek(header.end)
        found: list[tuple[int, int, int, int]] = []
        all_offsets: list[array[int]] = []
        for _ in info.counts:
            record = records.read_record(self.stream, limit)
            times, offsets = read_entries(self.stream, record)
            number = record.uint32("conn")
            all_offsets.append(offsets)
            rank = ranks.get(number)
            if rank is not None:
                found += [(at, time, rank, number) for time, at in zip(times, offsets, strict=True)]
        return sorted(found), all_offsets

    def _compare(
        self,
        start: int,
        entries: list[tuple[int, int, int, int]],
        all_offsets: list[array[int]],
        known: Mapping[int, Connection],
    ) -> None:
        """Check that the connection records before the chunk's messages match those in the bag's index.

        This is done once per connection. Raise BagFormatError if the records differ, or if the chunk's index is wrong.
        """
        limit = size_of(self.stream)
        for first, _, _, number in entries:
            if number in self._compared:
                continue
            self._compared.add(number)
            before = max((at for offsets in all_offsets for at in offsets if at < first), default=None)
            after = 0
            if before is not None:
                self.stream.seek(start + before)
                after = records.read_record(self.stream, limit).end - start
            if after > first:
                raise BagFormatError("an index entry does not point to its message", start + first)
            self.stream.seek(start + after)
            for record in records.parse_records(data := self.stream.read(first - after)):
                if record.op == records.OP_CONNECTION:
                    content = data[record.data_position : record.end]
                    _check_connection(records.parse_connection(record, content), known)

    def _picked(
        self, start: int, size: int, entries: list[tuple[int, int, int, int]]
    ) -> tuple[bytes, list[Found]]:
        """Return the concatenated message bodies, and their locations in the result.

        Raise BagFormatError if the index is wrong.
        """
        prefixes = {number: encoding.message_prefixes(number) for *_, number in entries}
        bodies: list[bytes] = []
        found: list[Found] = []
        end = 0
        for at, time, rank, number in entries:
            self.stream.seek(start + at)
            head = self.stream.read(_HEAD)
            if len(head) < _HEAD or not head.startswith(prefixes[number]):
                raise BagFormatError("an index entry does not point to its message", start + at)
            *stamp, length = _STAMP_AND_SIZE.unpack_from(head, _HEAD - _STAMP_AND_SIZE.size)
            if records.to_nanoseconds(*stamp) != time or at + _HEAD + length > size:
                raise BagFormatError("an index entry has another time than its message", start + at)
            bodies.append(self.stream.read(length))
            found.append((time, rank, at, end, end + length))
            end += length
        data = b"".join(bodies)
        if len(data) != end:
            raise BagFormatError(f"expecting {end} bytes, read {len(data)}", start)

        return data, found

    def _start(self) -> Executor:
        if self._executor is None:
            from concurrent.futures import ThreadPoolExecutor

            self._executor = ThreadPoolExecutor(THREADS, "decompress")
        return self._executor


THREADS = max(1, min(4, (os.cpu_count() or 1) - 1))
"""Number of decompression threads, and maximum number of chunks decompressed in advance.

Leaves one core to the reader's thread.
"""


# Maximum size in bytes of a chunk to decompress in advance; several such chunks may be in memory together
_MAX_AHEAD = 64 * 1024 * 1024

# Chunk bytes per requested message; above this ratio, read only the requested messages instead of the whole chunk
PICK_SIZE = 32 * 1024


def size_of(stream: BinaryIO) -> int:
    """Return a stream's size in bytes. Moves the stream's position."""
    return stream.seek(0, os.SEEK_END)


class _Layout(NamedTuple):
    """The layout of a message's header.

    The header has 46 bytes, two parts of which are constant; the field order depends on the writer.
    """

    form: struct.Struct
    first: bytes
    second: bytes


_OP = b"\x04\0\0\0op=\x02"
_CONN = b"\x09\0\0\0conn="
_TIME = b"\x0d\0\0\0time="
_PYTHON = _Layout(struct.Struct("<21sI9sIII"), b"\x26\0\0\0" + _OP + _CONN, _TIME)
_CPP = _Layout(struct.Struct("<13sI17sIII"), b"\x26\0\0\0" + _CONN, _OP + _TIME)
_HEAD = 46
_STAMP_AND_SIZE = struct.Struct("<III")


def scan(data: bytes, ranks: Ranks, known: Mapping[int, Connection]) -> list[Found]:
    """Return the messages in a chunk's data, in file order, for the connections that have ``ranks``.

    ``known`` contains all connections in the bag's index. Raise BagFormatError if a message has an unknown connection, or if a
    connection in the data has a different topic or type: the bag is then damaged.
    """
    found: list[Found] = []
    connections: dict[int, Connection] = {}
    scan_into(found, data, ranks, known, connections)
    for connection in connections.values():
        _check_connection(connection, known)
    return found


def scan_into(
    found: list[Found],
    data: bytes,
    ranks: Ranks,
    known: Container[int],
    connections: dict[int, Connection] | None = None,
) -> int:
    """Add the messages in a chunk's data to ``found``, and the connections to ``connections``; return the data's size.

    Raise BagFormatError if a record is damaged; the error's position is the end of the last complete record.
    """
    add = found.append
    end, last_head = len(data), len(data) - _HEAD
    (form, first, second), other = _PYTHON, _CPP
    unpack = form.unpack_from

    at = 0
    while at < end:
        if at <= last_head:
            one, number, two, seconds, nanoseconds, size = unpack(data, at)
            if one == first and two == second:
                body = at + _HEAD
                if (after := body + size) > end:
                    raise BagFormatError(f"a message of {size} bytes does not fit into its chunk", at)
                rank = ranks.get(number)
                if rank is not None:
                    add((seconds * 1_000_000_000 + nanoseconds, rank, at, body, after))
                elif number not in known:
                    raise BagFormatError(f"a message's connection {number} is not in the bag", at)
                at = after
                continue

            one, number, two, *_ = other.form.unpack_from(data, at)
            if one == other.first and two == other.second:
                (form, first, second), other = other, _Layout(form, first, second)
                unpack = form.unpack_from
                continue

        record = records.parse_record(data, at)
        if record.op == records.OP_MESSAGE_DATA:
            number = record.uint32("conn")
            rank = ranks.get(number)
            if rank is not None:
                add((record.time("time"), rank, at, record.data_position, record.end))
            elif number not in known:
                raise BagFormatError(f"a message's connection {number} is not in the bag", at)
        elif record.op == records.OP_CONNECTION and connections is not None:
            connection = records.parse_connection(record, data[record.data_position : record.end])
            connections.setdefault(connection.id, connection)
        at = record.end
    return end


_COMPARED = ("type", "md5sum", "message_definition")


def _check_connection(stored: Connection, known: Mapping[int, Connection]) -> None:
    """Raise BagFormatError if the index contains a different topic or type for a connection found in a chunk."""
    indexed = known.get(stored.id, stored)
    if indexed.topic == stored.topic and all(
        indexed.header.get(name) == stored.header.get(name) for name in _COMPARED
    ):
        return
    raise BagFormatError(
        f"connection {stored.id} is {_described(stored)} in its chunk, and {_described(indexed)} in the index: "
        "one of them is damaged; `rosbag reindex` takes that of the chunk"
    )


def _described(connection: Connection) -> str:
    return f"{connection.topic} [{connection.type}, {connection.md5sum}]"
