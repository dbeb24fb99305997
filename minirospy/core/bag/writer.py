"""Write bags: serialize messages with their times to a bag's bytes.

A chunk is collected in memory and then written in one piece, followed by its index: if the writer is killed, at most the
last chunk is incomplete, and :mod:`minirospy.core.bag.repair` recovers all chunks before it. A small message is copied
once, into the chunk; a large one passed as ``bytes`` is written without a copy. Memory use: the chunk, and some 200 bytes
for each connection in each written chunk. Source: http://wiki.ros.org/Bags/Format/2.0.
"""

from __future__ import annotations

import io
import struct
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

from minirospy.base.errors import BagFormatError
from minirospy.core.bag.compression import MAX_CHUNK_SIZE, NONE, check_compression, compress
from minirospy.core.bag.encoding import (
    encode_bag_header,
    encode_chunk_header,
    encode_chunk_info,
    encode_connection,
    encode_fields,
    message_prefixes,
)
from minirospy.core.bag.records import (
    MAGIC,
    MAX_UINT32,
    OP_INDEX_DATA,
    BagHeader,
    Chunk,
    ChunkInfo,
    Connection,
    to_nanoseconds,
)

if TYPE_CHECKING:
    from concurrent.futures import Executor

__all__ = ["CHUNK_THRESHOLD", "BagWriter", "Buffer", "Continued"]

Buffer = bytes | bytearray | memoryview

CHUNK_THRESHOLD = 768 * 1024  # uncompressed bytes at which a chunk is closed, as in ROS

_LARGE = 64 * 1024  # a message of at least this many bytes is not copied into the chunk

_BILLION = 10**9
_OVERHEAD = 46  # bytes in a message record besides the message's body
_ENTRY = struct.Struct("<III")
_TIME = struct.Struct("<II")
_UINT32 = struct.Struct("<I")


class _Stream:
    """The messages on one connection: their prefix, and their index in the current chunk."""

    __slots__ = ("connection", "entries", "in_order", "last", "prefix", "record")

    def __init__(self, connection: Connection, *, is_stored: bool) -> None:
        self.connection = connection
        self.prefix = message_prefixes(connection.id)[0]
        # The connection's record; empty once a chunk contains it
        self.record = b"" if is_stored else encode_connection(connection)
        self.clear()

    def clear(self) -> None:
        """Start the index for the next chunk."""
        self.entries = bytearray()
        self.last = 0
        self.in_order = True

    def sort(self) -> tuple[int, int]:
        """Sort the entries by time; return the first and the last time."""
        if not self.in_order:
            ordered = sorted(_ENTRY.iter_unpack(self.entries), key=lambda entry: entry[:2])
            self.entries = bytearray().join(_ENTRY.pack(*entry) for entry in ordered)
        first, last = (_TIME.unpack_from(self.entries, at) for at in (0, len(self.entries) - _ENTRY.size))
        return to_nanoseconds(*first), to_nanoseconds(*last)

    def encode_index(self) -> bytes:
        """Serialize the index record that follows the current chunk."""
        fields = {
            "op": bytes((OP_INDEX_DATA,)),
            "conn": _UINT32.pack(self.connection.id),
            "ver": _UINT32.pack(1),
            "count": _UINT32.pack(len(self.entries) // _ENTRY.size),
        }
        return encode_fields(fields) + _UINT32.pack(len(self.entries)) + self.entries


class _Complete(NamedTuple):
    """A complete chunk to be written: two functions for its data (see BagWriter._data), the data's size, and its index."""

    is_ready: Callable[[], bool]
    data: Callable[[], list[Buffer]]
    size: int
    start: int
    end: int
    counts: dict[int, int]
    indexes: bytes


class Continued(NamedTuple):
    """The index of a bag to append messages to, and the index's position."""

    connections: Iterable[Connection]
    chunks: Iterable[ChunkInfo]
    index_position: int


class BagWriter:
    """Writes a version 2.0 bag to a binary stream, which it does not close. Use it in one thread at a time.

    ``chunk_threshold``, in bytes, may be changed at any time. ``executor`` compresses chunks in parallel; without an
    executor, the calling thread compresses them. If more than ``max_waiting`` chunks are queued for compression,
    :meth:`write` blocks. ``continued``: append to the bag in the stream, overwriting its index. Raise
    BagCompressionError if the compression is unknown or its library is missing.

    After the stream has raised OSError, for example on a full disk, :meth:`salvage` turns the written part into a readable
    bag; this requires an unbuffered stream. Buffering gains nothing here, because each chunk is written in one piece.
    """

    def __init__(
        self,
        stream: BinaryIO,
        *,
        compression: str = NONE,
        chunk_threshold: int = CHUNK_THRESHOLD,
        executor: Executor | None = None,
        max_waiting: int = 4,
        continued: Continued | None = None,
    ) -> None:
        self.chunk_threshold = chunk_threshold
        self.chunks: list[ChunkInfo] = []  # the chunks already written
        self._stream = stream
        self._executor = executor
        self._max_waiting = max_waiting
        self._streams: dict[int, _Stream] = {}
        self._next_id = 0
        self._complete: deque[_Complete] = deque()
        # total size before compression of the complete chunks that have not been written yet, in bytes
        self._waiting = 0
        self._written = (0, 0)  # bytes of data in the written chunks: before compression, and as stored
        self._closed = False
        self._small = bytearray()
        self._pieces: list[Buffer] = []
        self._size = 0
        self._used: list[_Stream] = []
        self._set_compression(compression)

        if continued is None:
            self._header_position = stream.tell() + len(MAGIC)
            header = encode_bag_header(BagHeader(0, 0, 0))
            self._put([MAGIC, header])
            self._position = self._header_position + len(header)  # position of the next chunk in the stream
        else:
            self._continue(*continued)

    @property
    def compression(self) -> str:
        """Return the chunk compression; setting another one completes the current chunk.

        Raise BagCompressionError if it is unknown or its library is missing.
        """
        return self._compression

    @compression.setter
    def compression(self, name: str) -> None:
        check_compression(name)
        if name != self._compression:
            self.finish_chunk()
            self._write_complete(0)
            self._set_compression(name)

    @property
    def connections(self) -> list[Connection]:
        """The connections that have messages in the bag."""
        return [one.connection for one in self._streams.values() if not one.record]

    @property
    def size(self) -> int:
        """The bag's size so far in bytes; for data not compressed yet, estimated from the ratio so far.

        Before the first chunk is written, the data in memory counts as 0, because the ratio is unknown.
        """
        if self._compression == NONE:
            return self._position + self.gathered
        data, stored = self._written
        return self._position + (self.gathered * stored // data if data else 0)

    @property
    def gathered(self) -> int:
        """The number of buffered bytes not yet written to the stream."""
        return self._size + self._waiting

    def add_connection(self, topic: str, header: Mapping[str, str | bytes]) -> int:
        """Return the number of a new connection for :meth:`write`; ``header`` is the publisher's connection header.

        Raise BagFormatError if the header lacks type, md5sum or message_definition.
        """
        for name in ("type", "md5sum", "message_definition"):
            if name not in header:
                raise BagFormatError(f'the connection header of {topic} has no field "{name}"')
        number = self._next_id
        self._next_id += 1
        fields = {
            name: value if isinstance(value, bytes) else value.encode("utf-8", "surrogateescape")
            for name, value in header.items()
        }
        self._streams[number] = _Stream(Connection(number, topic, fields), is_stored=False)
        return number

    def write(self, connection: int, time: int, body: Buffer, *others: Buffer) -> None:
        """Write a message received at ``time``, in nanoseconds; its bytes are ``body`` followed by the others.

        ``bytes`` are referenced until the chunk is written, other buffers are copied. Raise BagFormatError if the message
        or its time exceeds a limit, OSError if the stream fails.
        """
        stream = self._streams[connection]
        length = len(body)
        for other in others:
            length += len(other)
        if self._size + len(stream.record) + _OVERHEAD + length > self._limit:
            self._make_room(stream, length)

        seconds, nanoseconds = divmod(time, _BILLION)
        try:
            entry = _ENTRY.pack(seconds, nanoseconds, self._size + len(stream.record))
        except struct.error:
            raise BagFormatError(
                f"the time {time} ns does not fit into a bag: it must be from 0 to 2106"
            ) from None

        small = self._small
        if stream.record:
            small += stream.record
            self._size += len(stream.record)
            stream.record = b""
        small += stream.prefix
        small += entry[:8]
        small += _UINT32.pack(length)
        if length < _LARGE:
            small += body
            for other in others:
                small += other
        else:
            self._add_large(body)
            for other in others:
                self._add_large(other)
        self._size += _OVERHEAD + length

        if not stream.entries:
            self._used.append(stream)
        stream.entries += entry
        if time < stream.last:
            stream.in_order = False
        stream.last = time
        if self._size > self.chunk_threshold:
            self.finish_chunk()

    def finish_chunk(self) -> None:
        """Complete the current chunk if it contains any messages. Raise OSError if the stream fails."""
        if not self._size:
            return
        counts: dict[int, int] = {}
        indexes: list[bytes] = []
        start, end = 2**63, 0
        for stream in self._used:
            counts[stream.connection.id] = len(stream.entries) // _ENTRY.size
            first, last = stream.sort()
            start, end = min(start, first), max(end, last)
            indexes.append(stream.encode_index())
            stream.clear()

        pieces = [*self._pieces, self._small] if self._small else self._pieces
        complete = _Complete(*self._data(pieces), self._size, start, end, counts, b"".join(indexes))
        self._start_chunk()
        self._complete.append(complete)
        self._waiting += complete.size
        self._write_complete(self._max_waiting)

    def write_ready(self) -> None:
        """Write the complete chunks that are already compressed. Raise OSError if the stream fails."""
        self._write_complete(len(self._complete))

    def flush(self) -> None:
        """Write all messages to the stream, and flush it. Raise OSError if the stream fails."""
        self.finish_chunk()
        self._write_complete(0)
        self._stream.flush()

    def close(self) -> None:
        """Complete the bag by writing its index. The stream stays open. Idempotent. Raise OSError if the stream fails."""
        if self._closed:
            return
        self.finish_chunk()
        self._write_complete(0)
        self._write_index()
        self._closed = True

    def salvage(self, written: int | None = None) -> int:
        """Close a bag whose stream has failed; return the number of lost messages.

        Removes incomplete chunks, and as many before them as necessary to free space for the index. ``written``: number
        of the bag's bytes that are known to have reached the disk, if that is not everything written before the error.
        Raise OSError if even an empty bag does not fit.
        """
        lost = sum(len(one.entries) // _ENTRY.size for one in self._used)
        lost += sum(sum(one.counts.values()) for one in self._complete)
        self._complete.clear()
        self._waiting = 0
        self._start_chunk()
        end = self._position if written is None else min(written, self._position)
        self._closed = True

        while True:
            # Drop chunks that end after ``end``: the last one ends at the position of the next.
            while self.chunks and self._position > end:
                dropped = self.chunks.pop()
                lost += sum(dropped.counts.values())
                self._position = dropped.position
            self._stream.seek(self._position)
            self._stream.truncate()
            kept = {number for chunk in self.chunks for number in chunk.counts}
            for number in self._streams.keys() - kept:
                self._streams[number].record = encode_connection(self._streams[number].connection)
            try:
                self._write_index()
            except OSError:
                if not self.chunks:
                    raise
                end = self._position - 1
                continue
            return lost

    def _set_compression(self, name: str) -> None:
        check_compression(name)
        self._compression = name
        # Limit compressed chunks further: random data grows when compressed, and minirospy's readers reject larger chunks.
        self._limit = MAX_UINT32 if name == NONE else MAX_CHUNK_SIZE

    def _continue(self, connections: Iterable[Connection], chunks: Iterable[ChunkInfo], end: int) -> None:
        self._streams = {one.id: _Stream(one, is_stored=True) for one in connections}
        self._next_id = max(self._streams, default=-1) + 1
        self.chunks.extend(chunks)

        # Write the header first: if the program is killed now, it marks the bag as not closed.
        self._header_position = len(MAGIC)
        self._stream.seek(self._header_position)
        self._put([encode_bag_header(BagHeader(0, 0, 0))])
        self._stream.seek(end)
        self._stream.truncate()
        self._position = end

    def _start_chunk(self) -> None:
        self._small = bytearray()
        self._pieces = []
        self._size = 0
        self._used = []

    def _make_room(self, stream: _Stream, length: int) -> None:
        """Start a new chunk, because the message would exceed the maximum size of the current one.

        Raise BagFormatError if the message does not fit into an empty chunk either.
        """
        if len(stream.record) + _OVERHEAD + length > self._limit:
            raise BagFormatError(
                f"a message of {length} bytes on {stream.connection.topic} is too large: "
                f"a chunk has {self._limit} bytes at most{'' if self._compression == NONE else ' where it is compressed'}"
            )
        self.finish_chunk()

    def _add_large(self, body: Buffer) -> None:
        if len(body) < _LARGE:
            self._small += body
            return
        if self._small:
            self._pieces.append(self._small)
            self._small = bytearray()
        # Copy any type except bytes, because the caller may change the data before it is written.
        self._pieces.append(body if type(body) is bytes else bytes(body))

    def _data(self, pieces: list[Buffer]) -> tuple[Callable[[], bool], Callable[[], list[Buffer]]]:
        """Return two functions: one returns whether the chunk's data is ready, the other waits for the data and returns it."""
        name = self._compression
        if name == NONE:
            return (lambda: True), (lambda: pieces)

        joined = b"".join(pieces)
        if self._executor is None:
            return (lambda: True), (lambda: [compress(name, joined)])
        future = self._executor.submit(compress, name, joined)
        return future.done, (lambda: [future.result()])

    def _write_complete(self, left: int) -> None:
        """Write the complete chunks in order, waiting for their compression while more than ``left`` of them remain."""
        while self._complete:
            chunk = self._complete[0]
            if len(self._complete) <= left and not chunk.is_ready():
                return
            data = chunk.data()
            stored = sum(map(len, data))
            header = encode_chunk_header(Chunk(self._compression, chunk.size, stored))

            self._put([header, *data, chunk.indexes])
            self.chunks.append(ChunkInfo(self._position, chunk.start, chunk.end, chunk.counts))
            self._position += len(header) + stored + len(chunk.indexes)
            self._written = self._written[0] + chunk.size, self._written[1] + stored
            self._complete.popleft()
            self._waiting -= chunk.size

    def _write_index(self) -> None:
        connections = self.connections
        self._put([encode_connection(one) for one in connections])
        self._put([b"".join(map(encode_chunk_info, self.chunks))])
        # Flush first, so that the header never refers to an index that has not been written.
        self._stream.flush()
        self._stream.seek(self._header_position)
        self._put([encode_bag_header(BagHeader(self._position, len(connections), len(self.chunks)))])
        self._stream.flush()
        self._stream.seek(0, io.SEEK_END)

    def _put(self, pieces: Iterable[Buffer]) -> None:
        write = self._stream.write
        for piece in pieces:
            count = write(piece)
            # Write the rest, because an unbuffered stream may write only part of the data.
            while count is not None and count < len(piece):
                count += write(memoryview(piece)[count:])
