"""Read bags from a seekable binary stream: connections, and messages in time order.

Opening a version 2.0 bag reads its first record, and its connections and chunk infos at the end. Messages are read chunk
by chunk; chunks that overlap in time are merged. Memory use: the chunk infos, and a few chunks. Source:
http://wiki.ros.org/Bags/Format/2.0; for version 1.2: `minirospy.core.bag.old_formats`.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from heapq import heappop, heappush
from types import MappingProxyType
from typing import BinaryIO

from minirospy.base.errors import BagFormatError, BagUnindexedError, BagVersionError
from minirospy.core.bag import records
from minirospy.core.bag.base import BagReader, Block, Position, StoredMessage
from minirospy.core.bag.chunks import THREADS, ChunkStream, Found, StoredChunk, scan, size_of
from minirospy.core.bag.index import ConnectionIndex, read_entries
from minirospy.core.bag.old_formats import open_old_bag
from minirospy.core.bag.records import ChunkInfo, Connection

__all__ = ["ChunkedReader", "open_bag"]

# Maximum bytes of overlapping chunks to keep decompressed in memory; beyond that, some chunks are read again
CACHE_SIZE = 64 * 1024 * 1024

_END_OF_TIME = 1 << 64


def open_bag(stream: BinaryIO) -> BagReader:
    """Return a reader for the bag that starts at the stream's position.

    Raise BagFormatError if it is not a bag, BagVersionError if its version is not supported, BagUnindexedError if
    it was not closed or its index is damaged, BagEncryptedError if it is encrypted.
    """
    version = records.read_version(stream)
    if version // 100 == 2:
        return ChunkedReader.open(stream, version)
    if version == 101:
        raise BagVersionError(
            version, f"unsupported bag version {version}. Please convert bag to newer format."
        )
    return open_old_bag(stream, version)


class ChunkedReader(BagReader):
    """A version 2.0 bag. ``connections`` and ``chunks`` may grow, because a bag can be read while it is written.

    ``headers``: a dict from chunk position to header, for chunks whose header in the file is incomplete.
    """

    def __init__(
        self,
        stream: BinaryIO,
        connections: dict[int, Connection],
        chunks: Sequence[ChunkInfo],
        version: int = 200,
        index_position: int = 0,
        headers: Mapping[int, StoredChunk] = MappingProxyType({}),
    ) -> None:
        self.version = version
        self.stream = stream
        self.connections = connections
        self.chunks = chunks
        self.index_position = index_position
        self._chunks = ChunkStream(stream)
        for position, header in headers.items():
            self._chunks.set_header(position, header)
        self._indexes: dict[int, ConnectionIndex] = {}
        self._indexed_chunks = 0

    @classmethod
    def open(cls, stream: BinaryIO, version: int = 200) -> ChunkedReader:
        """Read the bag's header, connections and chunk infos; the stream's position must be after the first line."""
        position = stream.tell()
        try:
            limit = size_of(stream)
            stream.seek(position)
            header = records.parse_bag_header(records.read_record(stream, limit))
            if not header.index_pos:
                raise BagUnindexedError
            if header.index_pos > limit:
                raise BagUnindexedError("the index is behind the file's end")

            stream.seek(header.index_pos)
            connections: dict[int, Connection] = {}
            for _ in range(header.connection_count):
                connection = _read_connection(stream, limit)
                connections[connection.id] = connection
            chunks = [_read_chunk_info(stream, limit) for _ in range(header.chunk_count)]
            _check_index(stream, limit, connections, chunks)
        except BagFormatError as error:
            raise BagUnindexedError(str(error)) from error
        return cls(stream, connections, chunks, version, header.index_pos)

    def blocks(
        self, connections: Sequence[int], start: int | None = None, end: int | None = None
    ) -> Iterator[Block]:
        """See :meth:`BagReader.blocks`."""
        ranks = {number: rank for rank, number in enumerate(connections)}
        first = 0 if start is None else start
        last = _END_OF_TIME if end is None else end
        chunks = [
            chunk
            for chunk in self.chunks
            if chunk.end_time >= first
            and chunk.start_time <= last
            and not ranks.keys().isdisjoint(chunk.counts)
        ]
        chunks.sort(key=_start_time)

        try:
            yield from _Merge(self._chunks, chunks, ranks, self.connections, (first, last)).blocks()
        finally:
            self._chunks.prepare(())

    def message_at(self, position: Position) -> StoredMessage:
        """See :meth:`BagReader.message_at`."""
        if isinstance(position, int):
            raise BagFormatError("no chunk at position", position)
        chunk, offset = position
        data = self._chunks.data(chunk)
        record = records.parse_record(data, offset)
        while record.op == records.OP_CONNECTION:
            record = records.parse_record(data, record.end)
        message = records.parse_message_data(record, data[record.data_position : record.end])
        if message.connection not in self.connections:
            raise BagFormatError(f"a message's connection {message.connection} is not in the bag", chunk)
        return StoredMessage(
            self.connections[message.connection], message.time, message.body, (chunk, record.position)
        )

    def index(self, connections: Iterable[int]) -> list[ConnectionIndex]:
        """See :meth:`BagReader.index`."""
        wanted = list(connections)
        missing = {number for number in wanted if number not in self._indexes}
        if self._indexed_chunks != len(self.chunks):
            missing.update(wanted)
            self._indexes.clear()
        if missing:
            self._indexes.update(self._read_index(missing))
            self._indexed_chunks = len(self.chunks)
        return [self._indexes[number] for number in wanted]

    def times(self, connections: Iterable[int]) -> list[array[int]]:
        """See :meth:`BagReader.times`. Does not cache the times."""
        found = {number: array("Q") for number in connections}
        for number, _, times, _ in self._index_records(set(found)):
            found[number].extend(times)
        return list(found.values())

    def chunk_headers(self) -> dict[int, StoredChunk]:
        """See :meth:`BagReader.chunk_headers`.

        Raise BagUnindexedError if a header is damaged, because that means that the index is wrong.
        """
        try:
            return {chunk.position: self._chunks.header(chunk.position) for chunk in self.chunks}
        except BagFormatError as error:
            raise BagUnindexedError(str(error)) from error

    def close(self) -> None:
        """See :meth:`BagReader.close`."""
        self._chunks.close()

    def _read_index(self, wanted: set[int]) -> dict[int, ConnectionIndex]:
        indexes = {number: ConnectionIndex() for number in wanted}
        for number, chunk, times, offsets in self._index_records(wanted):
            indexes[number].extend(times, offsets, chunk)
        return indexes

    def _index_records(self, wanted: set[int]) -> Iterator[tuple[int, int, array[int], array[int]]]:
        """Yield connection, chunk, times and offsets for each index record after the chunks.

        Raise BagUnindexedError if one is damaged.
        """
        limit = self.size()
        try:
            for chunk in self.chunks:
                if wanted.isdisjoint(chunk.counts):
                    continue
                self.stream.seek(self._chunks.header(chunk.position).end)
                for _ in chunk.counts:
                    record = records.read_record(self.stream, limit)
                    times, offsets = read_entries(self.stream, record)
                    if (number := record.uint32("conn")) in wanted:
                        yield number, chunk.position, times, offsets
        except BagFormatError as error:
            raise BagUnindexedError(str(error)) from error


class _Run:
    """A chunk whose messages are being yielded; ``done`` is the number of messages already yielded."""

    __slots__ = ("done", "number", "position")

    def __init__(self, number: int, position: int) -> None:
        self.number = number
        self.position = position
        self.done = 0


class _Merge:
    """Merges chunks, which may overlap, into blocks of messages in time order.

    Each chunk is a run of sorted messages. The data of pending runs stays in memory up to CACHE_SIZE; beyond that it is
    discarded and read again later, so that even a bag whose chunks all overlap needs no more memory.
    """

    def __init__(
        self,
        stream: ChunkStream,
        chunks: Sequence[ChunkInfo],
        ranks: Mapping[int, int],
        known: Mapping[int, Connection],
        times: tuple[int, int],
    ) -> None:
        self._stream = stream
        self._chunks = chunks
        self._ranks = ranks
        self._known = known
        self._times = times
        self._loaded: OrderedDict[int, tuple[bytes, list[Found]]] = OrderedDict()
        self._size = 0

    def blocks(self) -> Iterator[Block]:
        """Yield the messages as blocks, in order."""
        # Entries: time and rank of a run's next message, the chunk's position and its unique number, the run.
        heap: list[tuple[int, int, int, int, _Run]] = []
        number, count = 0, len(self._chunks)
        while heap or number < count:
            # Open a chunk when its first message may be the next one.
            while number < count and (not heap or self._chunks[number].start_time <= heap[0][0]):
                self._push(heap, _Run(number, self._chunks[number].position))
                number += 1
                self._stream.prepare(chunk.position for chunk in self._chunks[number : number + THREADS])
            if not heap:
                continue

            run = heappop(heap)[-1]
            data, found = self._load(run)
            stop = len(found)
            if heap:
                stop = bisect_left(found, heap[0][:2], run.done)
            if number < count:
                stop = min(stop, bisect_left(found, (self._chunks[number].start_time,), run.done))
            # If two messages have the same time and connection, yield the one in the earlier chunk first.
            stop = max(stop, run.done + 1)

            yield Block(
                run.position, data, found[run.done : stop] if run.done or stop < len(found) else found
            )
            run.done = stop
            if stop < len(found):
                self._push(heap, run)
            else:
                self._drop(run)

    def _push(self, heap: list[tuple[int, int, int, int, _Run]], run: _Run) -> None:
        _, found = self._load(run)
        if run.done < len(found):
            heappush(heap, (*found[run.done][:2], run.position, run.number, run))
        else:
            self._drop(run)

    def _load(self, run: _Run) -> tuple[bytes, list[Found]]:
        if run.position in self._loaded:
            self._loaded.move_to_end(run.position)
            return self._loaded[run.position]

        info = self._chunks[run.number]
        picked = self._stream.pick(info, self._ranks, self._known)
        if picked:
            data, found = picked
        else:
            data = self._stream.data(run.position)
            found = scan(data, self._ranks, self._known)
        first, last = self._times
        if info.start_time < first or info.end_time > last:
            found = [each for each in found if first <= each[0] <= last]
        found.sort()

        self._loaded[run.position] = data, found
        self._size += _weight(data, found)
        while self._size > CACHE_SIZE and len(self._loaded) > 2:
            _, dropped = self._loaded.popitem(last=False)
            self._size -= _weight(*dropped)
        return data, found

    def _drop(self, run: _Run) -> None:
        if dropped := self._loaded.pop(run.position, None):
            self._size -= _weight(*dropped)


def _weight(data: bytes, found: list[Found]) -> int:
    return len(data) + 200 * len(found)


def _start_time(chunk: ChunkInfo) -> int:
    return chunk.start_time


def _check_index(
    stream: BinaryIO, limit: int, connections: Mapping[int, Connection], chunks: Sequence[ChunkInfo]
) -> None:
    """Raise BagFormatError if the index does not match the bag header, because messages would then be missing."""
    positions: set[int] = set()
    for chunk in chunks:
        if chunk.position in positions:
            raise BagFormatError("the index names a chunk twice", chunk.position)
        positions.add(chunk.position)
        if not chunk.counts.keys() <= connections.keys():
            raise BagFormatError(
                "a chunk has messages of a connection that is not in the index", chunk.position
            )
    position = stream.tell()
    if position == limit:
        return
    try:
        more = records.read_record(stream, limit)
    except BagFormatError:
        return  # ignore data that other programs have appended
    if more.op in (records.OP_CHUNK_INFO, records.OP_CONNECTION):
        raise BagFormatError("the index has more records than the bag header counts", position)


def _read_connection(stream: BinaryIO, limit: int) -> Connection:
    record = records.read_record(stream, limit)
    return records.parse_connection(record, stream.read(record.data_size))


def _read_chunk_info(stream: BinaryIO, limit: int) -> ChunkInfo:
    record = records.read_record(stream, limit)
    return records.parse_chunk_info(record, stream.read(record.data_size))
