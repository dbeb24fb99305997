"""Read an MCAP file with messages of ROS 1 or ROS 2: connections, and messages in time order.

Opening reads the summary at the end of the file. Needs the extra ``minirospy[mcap]``. Source: https://mcap.dev/spec.
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from heapq import heapify, heappop, heapreplace
from io import BytesIO
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

from minirospy.base.errors import BagFormatError, McapUnindexedError, MessageException, MinirospyError
from minirospy.core.bag.base import BagReader, Block, Position, StoredMessage
from minirospy.core.bag.chunks import StoredChunk
from minirospy.core.bag.compression import NONE
from minirospy.core.bag.foreign_channels import Ros1Channel, ros1_channel
from minirospy.core.bag.index import ConnectionIndex
from minirospy.core.bag.mcap_repair import MAGIC, chunk_data, mcap_faults
from minirospy.core.bag.mcap_writer import check_mcap
from minirospy.core.bag.reader import open_bag
from minirospy.core.bag.records import Chunk, ChunkInfo, Connection, Fields

if TYPE_CHECKING:
    from mcap.records import Channel, Schema
    from mcap.summary import Summary

__all__ = ["MAGIC", "McapReader", "open_bag_or_mcap"]

_END_OF_TIME = 1 << 64
_TRANSIENT_LOCAL = re.compile(r"durability: *(1|transient_local)\b")  # ROS 2's latching, as rosbag2 stores it
_MAX_SCHEMA = 1_048_576  # maximum characters in a schema, the definition of a type and all types in it; real ones reach 30,000
_MAX_NAME = 32  # maximum bytes in a compression's name
_HEAD = struct.Struct("<BQ")  # the prefix of each record: its opcode, and the length of its content
_MESSAGE = struct.Struct("<HIQQ")  # the start of a message: its channel, sequence, log time and publish time
_CHUNK_HEAD = struct.Struct("<BQQQQII")
"""The start of a chunk record: record prefix; first and last time, uncompressed size, CRC, length of the compression's name."""
_LENGTH = struct.Struct("<Q")
# A footer including the record prefix: the positions of the summary and of its offsets, and the CRC
_FOOTER = struct.Struct("<BQQQI")


def open_bag_or_mcap(stream: BinaryIO) -> BagReader:
    """Return a reader for the bag or MCAP file that starts at the stream's position. Raise the same exceptions as the reader."""
    start = stream.tell()
    magic = stream.read(len(MAGIC))
    stream.seek(start)
    return McapReader(stream) if magic == MAGIC else open_bag(stream)


class McapReader(BagReader):
    """An MCAP file from ROS 1 or ROS 2. Presents its channels as bag connections.

    Messages of ROS 2 are converted if the file has their definitions and ROS 1 has the type. Channels that cannot be
    converted are not read; ``foreign`` contains their topics, each with the reason. Raise BagFormatError if the file is
    damaged, McapUnindexedError if its summary is missing or damaged, BagError if the extra is missing.
    """

    def __init__(self, stream: BinaryIO) -> None:
        check_mcap()
        self.version = 0
        self.stream = stream
        self.foreign: dict[str, str] = {}
        self._converters: dict[int, Callable[[bytes], bytes]] = {}
        self._converted_schemas: dict[tuple[int, str], Ros1Channel | MinirospyError] = {}
        self.connections = {}
        self._size = size = stream.seek(0, os.SEEK_END)
        stream.seek(max(size - len(MAGIC), 0))
        if size < 2 * len(MAGIC) or stream.read() != MAGIC:
            raise McapUnindexedError("its end is missing")
        try:
            with mcap_faults():
                summary = _read_summary(stream, size)
        except BagFormatError as error:
            raise McapUnindexedError(error.why) from error
        if summary is None or summary.statistics is None:
            raise McapUnindexedError("it has no summary")
        if len({chunk.chunk_start_offset for chunk in summary.chunk_indexes}) < len(summary.chunk_indexes):
            raise McapUnindexedError("its summary names a chunk twice")
        for channel in summary.channels.values():
            schema = summary.schemas.get(channel.schema_id)
            if channel.message_encoding == "ros1" and schema is not None:
                self.connections[channel.id] = _connection(channel, schema)
            else:
                self._add_foreign(channel, schema)
        self.statistics = summary.statistics
        self.chunks = _chunk_infos(summary, self.connections)
        self._summary = summary
        self._headers = {
            chunk.chunk_start_offset: StoredChunk(
                Chunk(chunk.compression or NONE, chunk.uncompressed_size, chunk.compressed_size),
                chunk.chunk_start_offset,
            )
            for chunk in summary.chunk_indexes
        }

    @property
    def version_name(self) -> str:
        """The name of the format in place of a bag version, followed by "of ROS 2" if the channels are converted."""
        return "MCAP 0 of ROS 2" if self._converters else "MCAP 0"

    def _add_foreign(self, channel: Channel, schema: Schema | None) -> None:
        """Add a ROS 2 channel, or record the reason why it cannot be converted."""
        if schema is None:
            self.foreign[channel.topic] = "it has no definition"
            return
        # Many channels may have the same schema: parse it once.
        key = schema.id, channel.message_encoding
        found = self._converted_schemas.get(key)
        if found is None:
            found = self._converted_schemas[key] = _conversion(schema, channel.message_encoding)
        if isinstance(found, MinirospyError):
            self.foreign[channel.topic] = f"[{schema.name}] {' '.join(str(found).split())}"
            return
        header: Fields = {
            "topic": channel.topic.encode(),
            "type": found.type.encode(),
            "md5sum": found.md5sum.encode(),
            "message_definition": found.definition.encode(),
        }
        if _TRANSIENT_LOCAL.search(channel.metadata.get("offered_qos_profiles", "")):
            header["latching"] = b"1"
        self.connections[channel.id] = Connection(channel.id, channel.topic, header)
        self._converters[channel.id] = found.to_ros1

    def _converted(self, channel: int, body: bytes, position: int) -> bytes:
        """Return a message's bytes in ROS 1's serialization. Raise BagFormatError if they do not match its definition."""
        convert = self._converters.get(channel)
        if convert is None:
            return body
        try:
            return convert(body)
        except MessageException as error:
            topic = self.connections[channel].topic
            raise BagFormatError(
                f"a message on {topic} does not match its definition: {error}", position
            ) from error

    def chunk_headers(self) -> dict[int, StoredChunk]:
        """See :meth:`BagReader.chunk_headers`."""
        return self._headers

    def messages(
        self, connections: Iterable[int] | None = None, start: int | None = None, end: int | None = None
    ) -> Iterator[StoredMessage]:
        """See :meth:`BagReader.messages`.

        If the file is damaged, raise BagFormatError after yielding the messages before the damage.
        """
        chosen = self.connections if connections is None else connections
        wanted = {number: self.connections[number] for number in chosen}
        first = 0 if start is None else start
        last = _END_OF_TIME if end is None else end
        selection = _Selection(self._summary.channels.keys(), wanted.keys(), first, last)
        # Read a chunk when its first message may be the next one.
        # Each chunk is thus loaded only once, and several are in memory only if they overlap in time.
        # Positions are unique, so the heap never compares two runs.
        heap = [(run.start, run.position, -1, run) for run in self._runs(wanted.keys(), first, last)]
        heapify(heap)
        while heap:
            _, position, at, run = heap[0]
            if at < 0:
                run.load(self.stream, self._size, selection)
            else:
                time, _, channel, body, after = run.messages[at]
                data = run.body(self.stream, body, after)
                if self._converters:
                    data = self._converted(channel, data, run.position)
                yield StoredMessage(wanted[channel], time, data, 0)
            if (at := at + 1) < len(run.messages):
                heapreplace(heap, (run.messages[at][0], position, at, run))
            else:
                heappop(heap)

    def _runs(self, wanted: Collection[int], first: int, last: int) -> list[_Run]:
        """Return the runs to read for these channels and times. Raise BagFormatError if the file is damaged."""
        indexes = self._summary.chunk_indexes
        if not indexes:
            return self._unindexed_runs()
        return [
            _Run(index.chunk_start_offset, index.message_start_time)
            for index in indexes
            if index.message_end_time >= first
            and index.message_start_time <= last
            # Include chunks without message indexes, which may contain any channel.
            and not (index.message_index_offsets and index.message_index_offsets.keys().isdisjoint(wanted))
        ]

    def _unindexed_runs(self) -> list[_Run]:
        """Return the chunks, or the messages outside of chunks, in a file without chunk indexes.

        Raise BagFormatError if the file is damaged.
        """
        from mcap.opcode import Opcode

        runs: list[_Run] = []
        loose = _Loose(0, 0)
        position = len(MAGIC)
        while position + _HEAD.size <= self._size:
            self.stream.seek(position)
            opcode, length = _HEAD.unpack(self.stream.read(_HEAD.size))
            if opcode in (Opcode.DATA_END, Opcode.FOOTER):
                break
            if opcode == Opcode.CHUNK:
                start = _read_chunk_header(self.stream, position, self._size).start
                runs.append(_Run(position, start))
            elif opcode == Opcode.MESSAGE:
                loose.places.append((position, length))
            position += _HEAD.size + length
        if position > self._size:
            raise BagFormatError("not a whole MCAP file: a record does not fit into it")
        if runs and loose.places:
            raise BagFormatError("messages are both inside and outside of chunks: `mcap recover` mends that")
        return runs or [loose]

    def blocks(
        self, connections: Sequence[int], start: int | None = None, end: int | None = None
    ) -> Iterator[Block]:
        """See :meth:`BagReader.blocks`."""
        ranks = {number: rank for rank, number in enumerate(connections)}
        for message in self.messages(connections, start, end):
            rank = ranks[message.connection.id]
            yield Block(0, message.body, [(message.time, rank, 0, 0, len(message.body))])

    def message_at(self, position: Position) -> StoredMessage:
        """Raise BagFormatError, because messages in MCAP files can only be read in order."""
        raise BagFormatError("messages of MCAP files are read in order only")

    def index(self, connections: Iterable[int]) -> list[ConnectionIndex]:
        """See :meth:`BagReader.index`. Reads the whole file."""
        indexes = {number: ConnectionIndex() for number in connections}
        for message in self.messages(list(indexes)):
            indexes[message.connection.id].extend([message.time], [0], 0)
        return list(indexes.values())


class _ChunkHeader(NamedTuple):
    """The header fields before a chunk's data, and the data's position."""

    start: int
    compression: str
    size: int
    data_position: int
    data_size: int


class _Selection(NamedTuple):
    """The caller's criteria for selecting messages."""

    known: Collection[int]
    """The channels in the summary. A message on any other channel means that the file is damaged."""
    wanted: Collection[int]
    first: int
    last: int
    """Last time in nanoseconds; the range is inclusive."""


class _Run:
    """The messages in one chunk, in time order.

    Each has a time, its record's offset in the chunk, a channel, and the start and end of its body.
    """

    def __init__(self, position: int, start: int) -> None:
        self.position = position
        self.start = start
        self.messages: list[tuple[int, int, int, int, int]] = []
        self._data = b""

    def load(self, stream: BinaryIO, limit: int, selection: _Selection) -> None:
        """Read the chunk, and find the selected messages. Raise BagFormatError if the chunk is damaged."""
        from mcap.opcode import Opcode

        with mcap_faults():
            header = _read_chunk_header(stream, self.position, limit)
            stream.seek(header.data_position)
            stored = stream.read(header.data_size)
            data = self._data = chunk_data(header.compression, stored, header.size)
        at, size = 0, len(data)
        while at + _HEAD.size <= size:
            opcode, length = _HEAD.unpack_from(data, at)
            body = at + _HEAD.size
            after = body + length
            if after > size:
                break
            if opcode == Opcode.MESSAGE:
                self._add(data, body, after, at, selection)
            at = after
        if at != size:
            raise BagFormatError("not a whole MCAP file: a record does not fit into its chunk", self.position)
        self.messages.sort()

    def body(self, stream: BinaryIO, start: int, end: int) -> bytes:
        """Return a message's bytes."""
        return self._data[start:end]

    def _add(self, data: bytes, start: int, end: int, place: int, selection: _Selection) -> None:
        known, wanted, first, last = selection
        if end - start < _MESSAGE.size:
            raise BagFormatError("not a whole MCAP file: a message is too short", self.position)
        channel, _, time, _ = _MESSAGE.unpack_from(data, start)
        if channel not in known:
            raise BagFormatError(
                f"not a whole MCAP file: a message's channel {channel} is not in the summary", self.position
            )
        if channel in wanted and first <= time <= last:
            self.messages.append((time, place, channel, start + _MESSAGE.size, end))


class _Loose(_Run):
    """The messages outside of chunks; ``places`` contains the positions and lengths of their records."""

    def __init__(self, position: int, start: int) -> None:
        super().__init__(position, start)
        self.places: list[tuple[int, int]] = []

    def load(self, stream: BinaryIO, limit: int, selection: _Selection) -> None:
        """See :meth:`_Run.load`."""
        for position, length in self.places:
            stream.seek(position + _HEAD.size)
            head = stream.read(min(length, _MESSAGE.size))
            before = len(self.messages)
            self._add(head, 0, len(head), position, selection)
            if len(self.messages) > before:
                time, place, channel, _, _ = self.messages[-1]
                start = position + _HEAD.size
                self.messages[-1] = (time, place, channel, start + _MESSAGE.size, start + length)
        self.messages.sort()

    def body(self, stream: BinaryIO, start: int, end: int) -> bytes:
        """See :meth:`_Run.body`."""
        stream.seek(start)
        return stream.read(end - start)


class _Bounded:
    """A stream for the mcap library, which may request a length from a damaged file.

    A read returns the available data, without allocating the requested length.
    """

    def __init__(self, data: bytes) -> None:
        self._stream = BytesIO(data)
        self._size = len(data)

    def read(self, length: int) -> bytes:
        return self._stream.read(min(length, self._size) if length >= 0 else 0)


def _read_summary(stream: BinaryIO, size: int) -> Summary | None:
    """Return the summary at the end of the file, or None if there is none.

    Raise BagFormatError, or one of the library's exceptions, if it is damaged.
    """
    from mcap import records
    from mcap.opcode import Opcode
    from mcap.stream_reader import StreamReader
    from mcap.summary import Summary

    footer = size - len(MAGIC) - _FOOTER.size
    stream.seek(max(footer, 0))
    data = stream.read(_FOOTER.size)
    opcode, length, start, _, _ = _FOOTER.unpack(data)
    if (opcode, length) != (Opcode.FOOTER, _FOOTER.size - _HEAD.size):
        raise BagFormatError("not a whole MCAP file: it has no footer")
    if not start:
        return None
    if start > footer:
        raise BagFormatError("not a whole MCAP file: its summary is behind its end")
    stream.seek(start)
    found = Summary()
    summary = _Bounded(stream.read(size - start))
    # Do not decompress any chunks, because a summary contains none.
    for record in StreamReader(summary, skip_magic=True, emit_chunks=True).records:  # type: ignore[arg-type]
        match record:
            case records.Statistics():
                found.statistics = record
            case records.Schema():
                found.schemas[record.id] = record
            case records.Channel():
                found.channels[record.id] = record
            case records.ChunkIndex():
                found.chunk_indexes.append(record)
    return found


def _read_chunk_header(stream: BinaryIO, position: int, limit: int) -> _ChunkHeader:
    """Return the header of the chunk at a position. Raise BagFormatError if there is no valid chunk."""
    from mcap.opcode import Opcode

    at = position + _CHUNK_HEAD.size
    if at > limit:
        raise BagFormatError("not a whole MCAP file: a chunk is behind its end")
    stream.seek(position)
    opcode, length, start, _, size, _, name_size = _CHUNK_HEAD.unpack(stream.read(_CHUNK_HEAD.size))
    if opcode != Opcode.CHUNK:
        raise BagFormatError("not a whole MCAP file: no chunk at the position of one", position)
    name = stream.read(min(name_size, _MAX_NAME + 1)).decode("utf-8", "replace")
    (data_size,) = _LENGTH.unpack(stream.read(_LENGTH.size).ljust(_LENGTH.size, b"\xff"))
    data_position = at + name_size + _LENGTH.size
    if name_size > _MAX_NAME or data_position + data_size > min(position + _HEAD.size + length, limit):
        raise BagFormatError("not a whole MCAP file: a chunk's data does not fit into it", position)
    return _ChunkHeader(start, name, size, data_position, data_size)


def _conversion(schema: Schema, message_encoding: str) -> Ros1Channel | MinirospyError:
    """Return the conversion of a schema's messages to ROS 1, or the reason why there is none."""
    if len(schema.data) > _MAX_SCHEMA:
        return BagFormatError(f"its definition has more than {_MAX_SCHEMA:,} characters")
    try:
        return ros1_channel(schema.name, schema.encoding, schema.data, message_encoding)
    except MinirospyError as error:
        return error


def _connection(channel: Channel, schema: Schema) -> Connection:
    header: Fields = {name: value.encode() for name, value in channel.metadata.items()}
    header.setdefault("topic", channel.topic.encode())
    header["type"] = schema.name.encode()
    header.setdefault("md5sum", b"*")
    header["message_definition"] = schema.data
    return Connection(channel.id, channel.topic, header)


def _chunk_infos(summary: Summary, known: Collection[int]) -> list[ChunkInfo]:
    """Return the chunk infos. The first one has the whole file's counts, because the summary has none per chunk."""
    assert summary.statistics is not None
    all_counts = summary.statistics.channel_message_counts
    counts = {number: count for number, count in all_counts.items() if number in known}
    infos = []
    for chunk in summary.chunk_indexes:
        infos.append(
            ChunkInfo(chunk.chunk_start_offset, chunk.message_start_time, chunk.message_end_time, counts)
        )
        counts = {}
    return infos
