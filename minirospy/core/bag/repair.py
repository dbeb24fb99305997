"""Repair a bag that was not closed, whose end is missing, or that is damaged: rebuild its index from its chunks.

Every complete chunk is recovered, and every complete message in an incomplete, uncompressed last chunk. A chunk with
damaged data is omitted from the index; after damage between records, the next chunk is searched for.
Source: http://wiki.ros.org/rosbag/Commandline#reindex.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

from minirospy.base.errors import BagCompressionError, BagFormatError
from minirospy.core.bag import compression, encoding, records
from minirospy.core.bag.chunks import Found, StoredChunk, scan_into, size_of
from minirospy.core.bag.index import read_entries
from minirospy.core.bag.records import BagHeader, Chunk, ChunkInfo, Connection, Record
from minirospy.core.bag.resync import is_record, next_chunk

__all__ = ["Repair"]

_END_OF_TIME = (records.MAX_UINT32 + 1) * 10**9
_Entry = tuple[int, int, int]
"""A message in a chunk's index: time, connection, record offset."""


class _Content(NamedTuple):
    """The contents of a chunk's data; ``end`` is the length of the complete records."""

    connections: dict[int, Connection]
    messages: list[Found]
    end: int

    @property
    def entries(self) -> list[_Entry]:
        """The sorted entries of the chunk's index."""
        return sorted(each[:3] for each in self.messages)

    @property
    def has_wrong_time(self) -> bool:
        """True if a message has a time that no index can contain.

        Such a time has more than 999,999,999 nanoseconds in the last second of the 32-bit range.
        """
        return any(each[0] >= _END_OF_TIME for each in self.messages)

    def info(self, position: int) -> ChunkInfo:
        """Return the chunk info record for this chunk at ``position``."""
        times = _times(self.entries)
        return ChunkInfo(position, times[0], times[-1], dict(Counter(each[1] for each in self.messages)))

    @property
    def index_records(self) -> bytes:
        """The chunk's index records."""
        entries: dict[int, list[tuple[int, int]]] = {}
        for time, number, at, _, _ in self.messages:
            entries.setdefault(number, []).append((time, at))
        return b"".join(encoding.encode_index_data(number, sorted(each)) for number, each in entries.items())


class _Edit(NamedTuple):
    """A range of bytes in the file, and its replacement."""

    start: int
    end: int
    data: bytes


class _Rewriting:
    """Applies edits to a file, in order and in place. Buffers output that would overwrite bytes not read yet."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._read = self._written = 0
        self._waiting = bytearray()

    @property
    def shift(self) -> int:
        """The offset, in bytes, to add to the positions of the following data."""
        return self._written + len(self._waiting) - self._read

    def copy_until(self, position: int) -> None:
        """Copy the file's bytes up to a position, moving them if necessary."""
        if not self.shift and not self._waiting:
            self._read = self._written = position
        while self._read < position:
            self._stream.seek(self._read)
            block = self._stream.read(min(_BLOCK, position - self._read))
            self._read += len(block)
            self._put(block)

    def replace(self, edit: _Edit) -> None:
        """Write the edit's replacement instead of the bytes in its range."""
        self._read = edit.end
        self._put(edit.data)

    def finish(self) -> int:
        """Truncate the file at the current position; return the number of bytes by which its end has moved."""
        shift, self._read = self.shift, self._read + len(self._waiting)
        self._put(b"")
        self._stream.seek(self._written)
        self._stream.truncate()
        return shift

    def _put(self, data: bytes) -> None:
        self._waiting += data
        ready = self._waiting[: max(self._read - self._written, 0)]
        self._stream.seek(self._written)
        self._stream.write(ready)
        self._written += len(ready)
        del self._waiting[: len(ready)]


class Repair:
    """Rebuilds the index of a version 2.0 bag, in place if the stream is writable.

    :meth:`run` sets ``connections``, ``chunks``, ``end`` (the position for the index), ``headers`` (of chunks whose header in
    the file is incomplete), and ``problems`` (lines about data that could not be recovered). :meth:`apply` removes the damaged
    ranges, which changes the chunks' positions.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self.connections: dict[int, Connection] = {}
        self.chunks: list[ChunkInfo] = []
        self.headers: dict[int, StoredChunk] = {}
        self.end = 0
        self.problems: list[str] = []
        self._stream = stream
        self._edits: list[_Edit] = []
        # number of chunk infos, according to the bag header, that have not been read yet
        self._infos_left = 0
        self._total = 0  # total of the message counts in the chunk infos read so far

    def run(self) -> Iterator[int]:
        """Read the records after the bag header; yield the position of each.

        Raise BagFormatError if it is not a bag, BagEncryptedError if it is encrypted.
        """
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
                position = self._go_on(position, error, limit)

        known = [chunk for chunk in self.chunks if chunk.counts.keys() <= self.connections.keys()]
        if len(known) < len(self.chunks):
            self.problems.append(
                f"{len(self.chunks) - len(known)} chunks have messages of unknown connections"
            )
            self.chunks = known
        self._report_lost()

    def apply(self) -> None:
        """Truncate the file after the last recovered chunk, and remove the damaged ranges before it.

        Raise OSError if the stream fails.
        """
        chunks = iter(self.chunks)
        moved: list[ChunkInfo] = []
        chunk = next(chunks, None)
        file, shift = _Rewriting(self._stream), 0
        edits = [edit for edit in self._edits if edit.end <= self.end]
        for edit in [*edits, _Edit(self.end, self.end, b"")]:
            file.copy_until(edit.start)
            while chunk and chunk.position <= edit.start:
                moved.append(chunk._replace(position=chunk.position + shift))
                chunk = next(chunks, None)
            file.replace(edit)
            shift = file.shift
        self.end += file.finish()
        self.chunks = moved
        self._edits, self.headers = [], {}

    def _read_header(self, limit: int) -> int:
        """Return the position of the first chunk; assume the usual size if the bag header is damaged."""
        start = len(records.MAGIC)
        self._stream.seek(start)
        try:
            record = records.read_record(self._stream, limit)
            header = records.parse_bag_header(record)
        except BagFormatError as error:
            self.problems.append(f"bag header: {error}")
            return start + len(encoding.encode_bag_header(BagHeader(0, 0, 0)))
        self._infos_left = header.chunk_count
        return record.end

    def _read(self, position: int, limit: int) -> int:
        """Read the record at a position and, for a chunk, its index records. Return the position after them.

        Raise BagFormatError if a record is damaged.
        """
        self._stream.seek(position)
        record = records.read_record(self._stream, limit)
        if record.op == records.OP_CONNECTION:
            data = self._stream.read(record.data_size)
            connection = records.parse_connection(record, data)
            self.connections.setdefault(connection.id, connection)
        if record.op == records.OP_CHUNK_INFO:
            info = records.parse_chunk_info(record, self._stream.read(record.data_size))
            self._total += sum(info.counts.values())
            self._infos_left -= 1
        if record.op != records.OP_CHUNK:
            return record.end
        if not record.data_size:
            # A writer fills in the chunk's size last, so a size of 0 means that it was killed before completing the chunk.
            raise BagFormatError("unterminated chunk")

        chunk = records.parse_chunk_header(record)
        try:
            data = compression.decompress(
                chunk.compression, self._stream.read(chunk.compressed_size), chunk.size
            )
            content = _content(data)
            if content.end < len(data):
                raise BagFormatError("a record of the chunk is damaged")
            self._check_connections(content)
            if content.has_wrong_time:
                # Add the connections even though the chunk is omitted, because later chunks may need them.
                self._add_connections(content)
                raise BagFormatError("a message of the chunk has a time that no index can hold")
        except (BagFormatError, BagCompressionError) as error:
            if not is_record(self._stream, record.end, limit):
                raise BagFormatError(getattr(error, "why", str(error))) from error
            self._problem(position, error)
            return record.end
        return self._add(record, content, limit)

    def _check_connections(self, content: _Content) -> None:
        """Raise BagFormatError if a connection in the chunk has another topic or type than in earlier chunks."""
        for number, connection in content.connections.items():
            known = self.connections.get(number, connection)
            if (known.topic, known.type, known.md5sum) != (
                connection.topic,
                connection.type,
                connection.md5sum,
            ):
                raise BagFormatError(
                    f"connection {number} is on {connection.topic} here, on {known.topic} before"
                )

    def _add_connections(self, content: _Content) -> None:
        # Add the connections in file order: ROS writes them to the index in that order.
        for number, connection in content.connections.items():
            self.connections.setdefault(number, connection)

    def _add(self, record: Record, content: _Content, limit: int) -> int:
        """Add a complete chunk; return the position after its index records."""
        self._add_connections(content)
        if not content.messages:
            return record.end
        self.end = self._check_index(record, content, limit)
        self.chunks.append(content.info(record.position))
        return self.end

    def _check_index(self, record: Record, content: _Content, limit: int) -> int:
        """Check a chunk's index records, and schedule a rewrite if they are damaged; return the position after them."""
        end, entries = _read_index(self._stream, record.end, limit)
        is_whole = entries == content.entries
        if is_whole and is_record(self._stream, end, limit):
            return end

        following = expected = record.end + len(content.index_records)
        if not is_record(self._stream, expected, limit):
            found = next_chunk(self._stream, record.end, limit)
            following = limit if found is None else found
        if is_whole and following > end:
            return end  # the damage is after the chunk's index
        if following > expected:
            self.problems.append(
                f"index of the chunk at byte {record.position}: {following - expected} bytes are left out"
            )
        self._edits.append(_Edit(record.end, following, content.index_records))
        return following

    def _go_on(self, position: int, error: BagFormatError, limit: int) -> int:
        """Return the position of the next chunk after damaged data, or ``limit`` if there is none."""
        following = next_chunk(self._stream, position + 1, limit)
        end = limit if following is None else following
        is_saved = self._read_partial(position, end, limit)
        if following is None:
            self._problem(position, error)
        elif not is_saved:
            self.problems.append(
                f"chunk at byte {position}: {error.why}: {end - position} bytes are left out"
            )
            self._edits.append(_Edit(position, end, b""))
        return end

    def _read_partial(self, position: int, end: int, limit: int) -> bool:
        """Recover the messages in an uncompressed chunk whose size is wrong; return whether any were found.

        At the end of the file, recover every complete message. Elsewhere, check the messages against the chunk's index
        records, and recover all of them or none.
        """
        record = _partial_chunk(self._stream, position, limit)
        if record is None:
            return False
        self._stream.seek(record.data_position)
        data = self._stream.read(min(end - record.data_position, records.MAX_UINT32))
        content = _content(data[: _whole_records(data)])
        if not content.messages or content.has_wrong_time:
            return False

        data_end = record.data_position + content.end
        _, entries = _read_index(self._stream, data_end, limit)
        if end < limit and _times(entries) != _times(content.entries):
            # Compare only the times: wrong offsets do not matter, because the index is rewritten.
            return False
        self._add_connections(content)
        self.chunks.append(content.info(position))
        self.end = end
        size = content.end.to_bytes(4, "little")
        header = encoding.encode_fields(record.fields | {"size": size}) + size
        self.headers[position] = StoredChunk(
            Chunk(compression.NONE, content.end, content.end), record.data_position
        )
        self._edits += [
            _Edit(position, record.data_position, header),
            _Edit(data_end, end, content.index_records),
        ]
        return True

    def _report_lost(self) -> None:
        """Report the number of missing messages, if the bag's own index still states the total number."""
        lost = self._total - sum(sum(chunk.counts.values()) for chunk in self.chunks)
        if self._infos_left == 0 and lost > 0:
            self.problems.append(f"{lost} of {self._total} messages are lost")

    def _problem(self, position: int, error: Exception) -> None:
        self.problems.append(f"chunk at byte {position}: {error}")


_BLOCK = 4 * 1024 * 1024


def _read_index(stream: BinaryIO, position: int, limit: int) -> tuple[int, list[_Entry]]:
    """Return the end position of the index records at ``position``, and their sorted entries."""
    found: list[_Entry] = []
    try:
        while position < limit:
            stream.seek(position)
            record = records.read_record(stream, limit)
            if record.op != records.OP_INDEX_DATA:
                break
            number = record.uint32("conn")
            found += [(time, number, at) for time, at in zip(*read_entries(stream, record), strict=True)]
            position = stream.tell()
    except BagFormatError:
        pass  # the caller finds the missing entries when it compares the index with the chunk
    return position, sorted(found)


def _times(entries: list[_Entry]) -> list[int]:
    return [time for time, _, _ in entries]


def _whole_records(data: bytes) -> int:
    """Return the total length of the complete message and connection records at the start of ``data``."""
    at = 0
    try:
        for record in records.parse_records(data):
            if record.op not in (records.OP_MESSAGE_DATA, records.OP_CONNECTION):
                break
            at = record.end
    except BagFormatError:
        pass
    return at


def _content(data: bytes) -> _Content:
    connections: dict[int, Connection] = {}
    messages: list[Found] = []
    try:
        end = scan_into(messages, data, _Any(), (), connections)
    except BagFormatError as error:
        end = error.position or 0
    return _Content(connections, messages, end)


class _Any:
    """Represents the ranks if all connections are requested. A connection's rank is its id."""

    def get(self, number: int, /) -> int | None:
        """Return a connection's rank."""
        return number


def _partial_chunk(stream: BinaryIO, position: int, limit: int) -> Record | None:
    """Return the record of an uncompressed chunk whose data is truncated, or None if the record is something else."""
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
