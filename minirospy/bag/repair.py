"""Repair of a bag that was not closed, or whose end is missing: its index is made again from its chunks.

Every whole chunk is recovered, and of a last chunk that is not compressed every whole message. A chunk whose
data is damaged is left out of the index. Source: http://wiki.ros.org/rosbag/Commandline#reindex.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

from minirospy.bag import compression, encoding, records
from minirospy.bag.chunks import Found, StoredChunk, scan_into, size_of
from minirospy.bag.index import read_entries
from minirospy.bag.records import BagHeader, Chunk, ChunkInfo, Connection, Record
from minirospy.errors import BagCompressionError, BagFormatError

__all__ = ["Repair"]


class _Content(NamedTuple):
    """The contents of a chunk's data; ``end``: bytes of whole records."""

    connections: dict[int, Connection]
    messages: list[Found]
    end: int

    def info(self, position: int) -> ChunkInfo:
        """Return the chunk's summary."""
        times = [each[0] for each in self.messages]
        return ChunkInfo(position, min(times), max(times), dict(Counter(each[1] for each in self.messages)))

    def index_records(self) -> bytes:
        """Return the chunk's index records."""
        entries: dict[int, list[tuple[int, int]]] = {}
        for time, number, at, _, _ in self.messages:
            entries.setdefault(number, []).append((time, at))
        return b"".join(encoding.encode_index_data(number, sorted(each)) for number, each in entries.items())


class Repair:
    """Makes the index of a bag of version 2.0 again, in place where the stream can be written.

    After :meth:`run`: ``connections``, ``chunks``, ``end`` is where the index goes, and ``problems`` are lines about what
    could not be recovered.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self.connections: dict[int, Connection] = {}
        self.chunks: list[ChunkInfo] = []
        self.end = 0
        self.problems: list[str] = []
        self._stream = stream
        self._tail: tuple[Record, _Content] | None = None
        """The last chunk, if its header or its index records have to be written again."""

    @property
    def tail(self) -> tuple[int, StoredChunk] | None:
        """The position of a last chunk whose header is not complete, and the header as it should be."""
        if self._tail is None:
            return None
        record, content = self._tail
        chunk = records.parse_chunk_header(record)
        if chunk.compression == compression.NONE:
            chunk = Chunk(compression.NONE, content.end, content.end)
        return record.position, StoredChunk(chunk, record.data_position)

    def run(self) -> Iterator[int]:
        """Read the chunks; yield the position of each. Raise BagFormatError if it is not a bag, BagEncryptedError."""
        stream = self._stream
        stream.seek(0)
        records.read_version(stream)
        limit = size_of(stream)
        position = self.end = self._read_header(limit)
        while position < limit:
            yield position
            try:
                position = self._read(position, limit)
            except BagFormatError as error:
                self._problem(position, error)
                break

        known = [chunk for chunk in self.chunks if chunk.counts.keys() <= self.connections.keys()]
        if len(known) < len(self.chunks):
            self.problems.append(
                f"{len(self.chunks) - len(known)} chunks have messages of unknown connections"
            )
            self.chunks = known

    def apply(self) -> None:
        """Make the file end after the last chunk that was recovered, with its header and index records. Raise OSError."""
        stream = self._stream
        if self._tail and self.tail:
            record, content = self._tail
            position, (chunk, data_position) = self.tail
            stream.seek(position)
            stream.write(encoding.encode_fields(record.fields | {"size": chunk.size.to_bytes(4, "little")}))
            stream.write(chunk.compressed_size.to_bytes(4, "little"))
            stream.seek(data_position + chunk.compressed_size)
            stream.truncate()
            stream.write(content.index_records())
            self.end = stream.tell()
            self._tail = None
        stream.seek(self.end)
        stream.truncate()

    def _read_header(self, limit: int) -> int:
        """Return where the first chunk is; a bag header that is damaged has the size of all others."""
        start = len(records.MAGIC)
        self._stream.seek(start)
        try:
            header = records.read_record(self._stream, limit)
            records.parse_bag_header(header)
        except BagFormatError as error:
            self.problems.append(f"bag header: {error}")
            return start + len(encoding.encode_bag_header(BagHeader(0, 0, 0)))
        return header.end

    def _read(self, position: int, limit: int) -> int:
        """Read the record at a position, and what belongs to it; return the position after it."""
        self._stream.seek(position)
        try:
            record = records.read_record(self._stream, limit)
        except BagFormatError:
            self._read_partial(position, limit)
            raise
        if record.op == records.OP_CONNECTION:
            data = self._stream.read(record.data_size)
            connection = records.parse_connection(record, data)
            self.connections.setdefault(connection.id, connection)
        if record.op != records.OP_CHUNK:
            return record.end
        if not record.data_size:
            # The header of a chunk is completed when the chunk is: its writer was killed.
            self._read_partial(position, limit)
            raise BagFormatError("unterminated chunk", position)

        chunk = records.parse_chunk_header(record)
        try:
            data = compression.decompress(
                chunk.compression, self._stream.read(chunk.compressed_size), chunk.size
            )
            content = _content(data)
            if content.end < len(data):
                raise BagFormatError("a record of the chunk is damaged")
        except (BagFormatError, BagCompressionError) as error:
            self._problem(position, error)
            return record.end
        return self._add(record, content, limit)

    def _add(self, record: Record, content: _Content, limit: int) -> int:
        """Add a whole chunk; return the position after its index records."""
        for number, connection in content.connections.items():
            self.connections.setdefault(number, connection)
        if not content.messages:
            return record.end
        info = content.info(record.position)

        position, indexed = record.end, 0
        try:
            while position < limit and indexed < len(content.messages):
                self._stream.seek(position)
                index = records.read_record(self._stream, limit)
                if index.op != records.OP_INDEX_DATA:
                    break
                times, _ = read_entries(self._stream, index)
                indexed += len(times)
                position = self._stream.tell()
        except BagFormatError:
            position = limit
        if indexed != len(content.messages):
            if position < limit:
                raise BagFormatError(f"index shorter than expected ({indexed} vs {len(content.messages)})")
            self._tail = record, content
        self.chunks.append(info)
        self.end = position
        return position

    def _read_partial(self, position: int, limit: int) -> None:
        """Recover the whole messages of a chunk that is cut off, unless it is compressed."""
        record = _partial_chunk(self._stream, position, limit)
        if record is None:
            return
        self._stream.seek(record.data_position)
        content = _content(self._stream.read(min(limit - record.data_position, records.MAX_UINT32)))
        if content.messages:
            self.connections = content.connections | self.connections
            self.chunks.append(content.info(position))
            self._tail = record, content

    def _problem(self, position: int, error: Exception) -> None:
        self.problems.append(f"chunk at byte {position}: {error}")


def _content(data: bytes) -> _Content:
    connections: dict[int, Connection] = {}
    messages: list[Found] = []
    try:
        end = scan_into(messages, data, _Any(), (), connections)
    except BagFormatError as error:
        end = error.position or 0
    return _Content(connections, messages, end)


class _Any:
    """Ranks of all connections: their ids."""

    def get(self, number: int, /) -> int | None:
        """Return the rank."""
        return number


def _partial_chunk(stream: BinaryIO, position: int, limit: int) -> Record | None:
    """Return the record of an uncompressed chunk whose data ends too early; None if it is something else."""
    try:
        stream.seek(position)
        head = stream.read(min(4096, limit - position))
        size = int.from_bytes(head[:4], "little")
        if len(head) < size + 8:
            return None
        fields = records.parse_fields(head[4 : 4 + size], position)
        record = Record(position, fields.get("op", b"\0")[0], fields, position + size + 8, 0)
        is_chunk = record.op == records.OP_CHUNK and record.text("compression") == compression.NONE
    except (BagFormatError, IndexError):
        return None
    return record if is_chunk else None
