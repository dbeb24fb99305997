"""Read version 1.2 bags, which have no chunks: definitions and messages alternate in the file.

Such a bag has an index at its end if it has a bag header. The results are the same as those of
`minirospy.core.bag.reader`. Source: http://wiki.ros.org/Bags/Format/1.2.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Sequence
from typing import BinaryIO

from minirospy.base.errors import BagFormatError, BagUnindexedError
from minirospy.core.bag import records
from minirospy.core.bag.base import Block, Position, ScannedReader, StoredMessage
from minirospy.core.bag.chunks import size_of
from minirospy.core.bag.index import ConnectionIndex, Entry, merge_entries
from minirospy.core.bag.records import ChunkInfo, Connection, Record

__all__ = ["Reader12", "open_bag12", "unindexed_bag12"]

_ENTRY = struct.Struct("<IIQ")


class Reader12(ScannedReader):
    """A version 1.2 bag, with one connection per topic.

    ``start``: the position of the first record. ``indexed`` is False until :meth:`read_index` or :meth:`scan` is called.
    """

    def __init__(self, stream: BinaryIO, version: int, start: int) -> None:
        self.version = version
        self.stream = stream
        self.connections: dict[int, Connection] = {}
        self.chunks: Sequence[ChunkInfo] = ()
        self.indexed = False
        self.start = start
        self._by_topic: dict[str, int] = {}
        self._indexes: dict[int, ConnectionIndex] = {}

    def read_index(self) -> None:
        """Read the index at the end of the bag. Raise BagUnindexedError if it is missing or damaged."""
        try:
            limit = size_of(self.stream)
            self.stream.seek(self.start)
            header = records.read_record(self.stream, limit)
            header.expect(records.OP_BAG_HEADER)
            position = header.uint64("index_pos")
            if not position:
                raise BagUnindexedError
            if position > limit:
                raise BagUnindexedError("the index is behind the file's end")
            if header.end < position == limit:
                raise BagUnindexedError("the index is missing")

            while position < limit:
                self.stream.seek(position)
                record = records.read_record(self.stream, limit)
                self._read_topic_index(record, limit)
                position = record.end
            self.indexed = True
        except BagFormatError as error:
            raise BagUnindexedError(str(error)) from error

    def scan(self) -> Iterator[int]:
        """Build the index from the messages; yield each record's position before reading it. Stop at the first damaged record."""
        self.connections.clear()
        self._by_topic.clear()
        self._indexes.clear()
        limit = size_of(self.stream)
        position = self.start

        while position < limit:
            yield position
            self.stream.seek(position)
            try:
                record = records.read_record(self.stream, limit)
                if record.op == records.OP_MESSAGE_DEFINITION:
                    self._define(record)
                elif record.op == records.OP_MESSAGE_DATA:
                    connection = self._connection_of(record)
                    self._indexes[connection].extend([_time_of(record)], [position])
            except BagFormatError:
                break
            position = record.end
        self.indexed = True

    def prepare(self) -> None:
        """See :meth:`BagReader.prepare`."""
        if not self.indexed:
            for _ in self.scan():
                pass

    def blocks(
        self, connections: Sequence[int], start: int | None = None, end: int | None = None
    ) -> Iterator[Block]:
        """See :meth:`BagReader.blocks`."""
        ranks = {number: rank for rank, number in enumerate(connections)}
        entries: Iterator[Entry] = merge_entries(
            self._indexes[number].between(start, end) for number in connections
        )
        for entry in entries:
            connection, time, body, position = self.message_at(entry.offset)
            assert isinstance(position, int)
            rank = ranks.get(connection.id)
            if rank is None:
                raise BagFormatError("an index entry does not point to its message", entry.offset)
            yield Block(None, body, [(time, rank, position, 0, len(body))])

    def message_at(self, position: Position) -> StoredMessage:
        """See :meth:`BagReader.message_at`."""
        if not isinstance(position, int):
            raise BagFormatError("a bag of version 1.2 has no chunks")
        limit = size_of(self.stream)
        self._seek(position, limit)
        record = records.read_record(self.stream, limit)
        while record.op == records.OP_MESSAGE_DEFINITION:
            self.stream.seek(record.end)
            record = records.read_record(self.stream, limit)
        record.expect(records.OP_MESSAGE_DATA)

        body = self.stream.read(record.data_size)
        return StoredMessage(
            self.connections[self._connection_of(record)], _time_of(record), body, record.position
        )

    def index(self, connections: Iterable[int]) -> list[ConnectionIndex]:
        """See :meth:`BagReader.index`."""
        return [self._indexes[number] for number in connections]

    def _seek(self, position: int, limit: int) -> None:
        """Seek to a position taken from the index. Raise BagFormatError if it is beyond the end of the file."""
        if position > limit:
            raise BagFormatError("an index entry is behind the file's end", position)
        self.stream.seek(position)

    def _read_topic_index(self, record: Record, limit: int) -> None:
        record.expect(records.OP_INDEX_DATA)
        if (version := record.uint32("ver")) != 0:
            raise BagFormatError(f"expecting index version 0, got {version}", record.position)
        count = record.uint32("count")
        if not count or record.data_size < count * _ENTRY.size:
            raise BagFormatError(f"an index of {count} messages has only {record.data_size} bytes")
        entries = list(_ENTRY.iter_unpack(self.stream.read(count * _ENTRY.size)))

        # Read the definition: it precedes a topic's first message, and the first index entry refers to it.
        self._seek(entries[0][2], limit)
        definition = records.read_record(self.stream, limit)
        definition.expect(records.OP_MESSAGE_DEFINITION)
        number = self._define(definition)
        self._indexes[number].extend(
            [records.to_nanoseconds(seconds, rest) for seconds, rest, _ in entries],
            [offset for _, _, offset in entries],
        )

    def _define(self, record: Record) -> int:
        topic = record.text("topic")
        if topic not in self._by_topic:
            header = {
                "topic": record.field("topic"),
                "type": record.field("type"),
                "md5sum": record.field("md5"),
                "message_definition": record.field("def"),
            }
            self._add(topic, header)
        return self._by_topic[topic]

    def _connection_of(self, record: Record) -> int:
        topic = record.text("topic")
        if topic not in self._by_topic:
            # Copy the definition from a topic with the same type, because definitions are stored once per type.
            type_ = record.text("type")
            like = next((each for each in self.connections.values() if each.type == type_), None)
            if like is None:
                raise BagFormatError(
                    f"Topic {topic} of datatype {type_} not preceded by message definition", record.position
                )
            self._add(topic, like.header | {"topic": record.field("topic")})
        return self._by_topic[topic]

    def _add(self, topic: str, header: records.Fields) -> None:
        number = len(self.connections)
        self.connections[number] = Connection(number, topic, header)
        self._by_topic[topic] = number
        self._indexes[number] = ConnectionIndex()


def open_bag12(stream: BinaryIO, version: int) -> Reader12:
    """Return a reader for the bag whose first line has been read.

    A bag without a bag header has no index, and must be scanned before it is read. Raise BagUnindexedError if there is a bag
    header but no index.
    """
    start = stream.tell()
    limit = size_of(stream)
    stream.seek(start)
    reader = Reader12(stream, version, start)
    if records.read_record(stream, limit).op == records.OP_BAG_HEADER:
        reader.read_index()
    return reader


def unindexed_bag12(stream: BinaryIO) -> Reader12:
    """Return a reader that can scan the unindexed bag at the stream's position.

    Raise BagFormatError if it is not a bag of this version.
    """
    version = records.read_version(stream)
    return Reader12(stream, version, stream.tell())


def _time_of(record: Record) -> int:
    return records.to_nanoseconds(record.uint32("sec"), record.uint32("nsec"))
