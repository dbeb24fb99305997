"""An MCAP file with messages of ROS 1 in, connections and messages in the order of time out.

Opening reads the summary at the file's end. Needs the extra ``minirospy[mcap]``. Source: https://mcap.dev/spec.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, BinaryIO

from minirospy.bag.base import BagReader, Block, Position, StoredMessage
from minirospy.bag.chunks import StoredChunk
from minirospy.bag.compression import NONE
from minirospy.bag.index import ConnectionIndex
from minirospy.bag.mcap_repair import MAGIC, mcap_faults
from minirospy.bag.mcap_writer import check_mcap
from minirospy.bag.reader import open_bag
from minirospy.bag.records import Chunk, ChunkInfo, Connection, Fields
from minirospy.errors import BagFormatError, McapUnindexedError

if TYPE_CHECKING:
    from mcap.reader import SeekingReader
    from mcap.records import Channel, Schema
    from mcap.summary import Summary

__all__ = ["MAGIC", "McapReader", "open_bag_or_mcap"]


def open_bag_or_mcap(stream: BinaryIO) -> BagReader:
    """Return a reader of the bag or MCAP file that starts at the stream's position. Raise what those raise."""
    start = stream.tell()
    magic = stream.read(len(MAGIC))
    stream.seek(start)
    return McapReader(stream) if magic == MAGIC else open_bag(stream)


class McapReader(BagReader):
    """An MCAP file of profile ``ros1``; its channels are the connections.

    Channels of other encodings are not read: ``foreign`` names their topics. Raise BagFormatError where the file is damaged,
    McapUnindexedError where its summary is missing or damaged, BagError if the extra is missing.
    """

    def __init__(self, stream: BinaryIO) -> None:
        check_mcap()
        from mcap.reader import SeekingReader

        self.version = 0
        self.stream = stream
        self.foreign: list[str] = []
        self.connections = {}
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(size - len(MAGIC), 0))
        if size < 2 * len(MAGIC) or stream.read() != MAGIC:
            raise McapUnindexedError("its end is missing")
        stream.seek(0)
        try:
            with mcap_faults():
                self._reader: SeekingReader = SeekingReader(stream)
                summary = self._reader.get_summary()
        except BagFormatError as error:
            raise McapUnindexedError(error.why) from error
        if summary is None or summary.statistics is None:
            raise McapUnindexedError("it has no summary")
        for channel in summary.channels.values():
            schema = summary.schemas.get(channel.schema_id)
            if channel.message_encoding == "ros1" and schema is not None:
                self.connections[channel.id] = _connection(channel, schema)
            else:
                self.foreign.append(channel.topic)
        self.statistics = summary.statistics
        self.chunks = _chunk_infos(summary)
        self._headers = {
            chunk.chunk_start_offset: StoredChunk(
                Chunk(chunk.compression or NONE, chunk.uncompressed_size, chunk.compressed_size),
                chunk.chunk_start_offset,
            )
            for chunk in summary.chunk_indexes
        }

    @property
    def version_name(self) -> str:
        """The format, in place of a bag's version."""
        return "MCAP 0"

    def chunk_headers(self) -> dict[int, StoredChunk]:
        """See :meth:`BagReader.chunk_headers`."""
        return self._headers

    def messages(
        self, connections: Iterable[int] | None = None, start: int | None = None, end: int | None = None
    ) -> Iterator[StoredMessage]:
        """See :meth:`BagReader.messages`."""
        wanted = {number: self.connections[number] for number in connections or self.connections}
        topics = {connection.topic for connection in wanted.values()}
        with mcap_faults():
            for _, channel, message in self._reader.iter_messages(
                topics, starting_at=start, ending_before=None if end is None else end + 1
            ):
                if connection := wanted.get(channel.id):
                    yield StoredMessage(connection, message.log_time, message.data, 0)

    def blocks(
        self, connections: Sequence[int], start: int | None = None, end: int | None = None
    ) -> Iterator[Block]:
        """See :meth:`BagReader.blocks`."""
        ranks = {number: rank for rank, number in enumerate(connections)}
        for message in self.messages(connections, start, end):
            rank = ranks[message.connection.id]
            yield Block(0, message.body, [(message.time, rank, 0, 0, len(message.body))])

    def message_at(self, position: Position) -> StoredMessage:
        """Raise BagFormatError: messages are read in order only."""
        raise BagFormatError("messages of MCAP files are read in order only")

    def index(self, connections: Iterable[int]) -> list[ConnectionIndex]:
        """See :meth:`BagReader.index`; the file is read whole."""
        indexes = {number: ConnectionIndex() for number in connections}
        for message in self.messages(list(indexes)):
            indexes[message.connection.id].extend([message.time], [0], 0)
        return list(indexes.values())


def _connection(channel: Channel, schema: Schema) -> Connection:
    header: Fields = {name: value.encode() for name, value in channel.metadata.items()}
    header.setdefault("topic", channel.topic.encode())
    header["type"] = schema.name.encode()
    header.setdefault("md5sum", b"*")
    header["message_definition"] = schema.data
    return Connection(channel.id, channel.topic, header)


def _chunk_infos(summary: Summary) -> list[ChunkInfo]:
    """Return the chunks; the first one has the counts of all, which the summary does not have for each."""
    assert summary.statistics is not None
    counts = dict(summary.statistics.channel_message_counts)
    infos = []
    for chunk in summary.chunk_indexes:
        infos.append(
            ChunkInfo(chunk.chunk_start_offset, chunk.message_start_time, chunk.message_end_time, counts)
        )
        counts = {}
    return infos
