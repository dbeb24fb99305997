"""Repair an MCAP file whose end is missing or damaged: rebuild its summary from its chunks.

Every complete chunk is recovered; a chunk with damaged data is omitted from the index. Source: https://mcap.dev/spec.
"""

from __future__ import annotations

import contextlib
import io
import os
import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

from minirospy.base.errors import BagCompressionError, BagFormatError
from minirospy.core.bag import compression

if TYPE_CHECKING:
    from mcap.records import (
        AttachmentIndex,
        Channel,
        Chunk,
        ChunkIndex,
        MessageIndex,
        MetadataIndex,
        Schema,
        Statistics,
    )

__all__ = ["MAGIC", "McapRepair", "chunk_data", "mcap_faults"]

MAGIC = b"\x89MCAP0\r\n"  # the first and last bytes of an MCAP file

_HEAD = struct.Struct("<BQ")  # the prefix of each record: its opcode, and the length of its content
_MESSAGE = struct.Struct("<HIQ")  # the start of a message: its channel, sequence and time

# dict from channel to the times and offsets of a chunk's messages
_Entries = dict[int, list[tuple[int, int]]]


@contextlib.contextmanager
def mcap_faults() -> Iterator[None]:
    """Convert the exceptions that the library raises on damaged files into BagFormatError."""
    from mcap.exceptions import McapError
    from zstandard import ZstdError

    try:
        yield
    except (McapError, ZstdError, struct.error, LookupError, StopIteration, UnicodeDecodeError) as error:
        raise BagFormatError(f"not a whole MCAP file: {error or type(error).__name__}") from error
    except (EOFError, OSError, ValueError, RuntimeError, ArithmeticError, MemoryError, TypeError) as error:
        # Decompressors raise these errors for lengths that exceed the memory.
        # Seeking before the start of a short file raises these errors, too.
        raise BagFormatError(f"not a whole MCAP file: {error}") from error


def chunk_data(name: str, data: bytes, size: int) -> bytes:
    """Decompress a chunk's data.

    Raise BagFormatError if the data is damaged, BagCompressionError if the compression is not supported.
    """
    try:
        return compression.decompress_mcap(name, data, size)
    except BagFormatError as error:
        raise BagFormatError(f"not a whole MCAP file: {error.why}") from error


class _Recovered(NamedTuple):
    """A recovered chunk: the messages on each of its channels, and the position after the chunk and its message indexes."""

    info: ChunkIndex
    counts: Counter[int]
    end: int


class McapRepair:
    """Rebuilds an MCAP file's summary in place. Requires the ``mcap`` package.

    ``limit``: number of bytes at the start of the stream that are known to be written; by default, the whole stream.
    After :meth:`run`, ``problems`` contains lines about data that could not be recovered.
    """

    def __init__(self, stream: BinaryIO, limit: int | None = None) -> None:
        self.problems: list[str] = []
        self._stream = stream
        self._limit = stream.seek(0, os.SEEK_END) if limit is None else limit
        self._end = 0
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._chunks: list[_Recovered] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._has_loose = False
        self._entries: _Entries = {}  # entries for the last chunk, until its message indexes have been read

    def run(self) -> Iterator[int]:
        """Read the records; yield the position of each. Raise BagFormatError if not even the header is complete."""
        from mcap.opcode import Opcode

        self._stream.seek(0)
        if self._stream.read(len(MAGIC)) != MAGIC:
            raise BagFormatError("not an MCAP file")
        position = len(MAGIC)
        while (content := self._content(position)) is not None:
            opcode, data = content
            if not self._end and opcode != Opcode.HEADER:
                break
            if opcode in (Opcode.DATA_END, Opcode.FOOTER):
                break
            yield position
            end = position + _HEAD.size + len(data)
            try:
                with mcap_faults():
                    self._add(opcode, data, position)
            except (BagFormatError, BagCompressionError) as error:
                self.problems.append(f"record at byte {position}: {getattr(error, 'why', error)}")
            position = end
            self._end = end
        if not self._end:
            raise BagFormatError("the header of the MCAP file is not whole")

    def apply(self) -> int:
        """Write the summary after the chunks and return the message count.

        On a full disk, remove chunks from the end until the summary fits. Raise OSError if it does not fit without chunks
        either.
        """
        tail = self._message_indexes() if self._entries else b""
        while True:
            self._stream.seek(self._end)
            self._stream.truncate()
            try:
                self._write(tail)
            except OSError:
                if not self._chunks:
                    raise
                self._end, tail = self._chunks.pop().info.chunk_start_offset, b""
                continue
            self._stream.flush()
            return sum(chunk.counts.total() for chunk in self._chunks)

    def _content(self, position: int) -> tuple[int, bytes] | None:
        """Return the opcode and content of the record at a position, or None if it is incomplete."""
        if position + _HEAD.size > self._limit:
            return None
        self._stream.seek(position)
        opcode, size = _HEAD.unpack(self._stream.read(_HEAD.size))
        if position + _HEAD.size + size > self._limit:
            return None
        data = self._stream.read(size)
        return (opcode, data) if len(data) == size else None

    def _add(self, opcode: int, data: bytes, position: int) -> None:
        from mcap import records
        from mcap.data_stream import ReadDataStream
        from mcap.opcode import Opcode

        stream = ReadDataStream(io.BytesIO(data))
        length = _HEAD.size + len(data)
        if opcode == Opcode.MESSAGE_INDEX:
            self._add_message_index(records.MessageIndex.read(stream), position, length)
            return
        if self._entries:
            # The last chunk's message indexes are incomplete. Discard them: a chunk must have all of them or none.
            self._chunks[-1].info.message_index_offsets.clear()
            self._chunks[-1].info.message_index_length = 0
            self._entries = {}
        if opcode == Opcode.MESSAGE:
            if not self._has_loose:
                self._has_loose = True
                raise BagFormatError("messages outside of chunks are left out: `mcap recover` keeps them")
        elif opcode == Opcode.CHUNK:
            self._add_chunk(records.Chunk.read(stream), position, length)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._add_definition(opcode, data)
        elif opcode == Opcode.ATTACHMENT:
            one = records.Attachment.read(stream)
            self._attachments.append(
                records.AttachmentIndex(
                    offset=position,
                    length=length,
                    log_time=one.log_time,
                    create_time=one.create_time,
                    data_size=len(one.data),
                    name=one.name,
                    media_type=one.media_type,
                )
            )
        elif opcode == Opcode.METADATA:
            self._metadata.append(
                records.MetadataIndex(offset=position, length=length, name=records.Metadata.read(stream).name)
            )

    def _add_definition(self, opcode: int, data: bytes) -> None:
        """Add a schema or a channel."""
        from mcap import records
        from mcap.data_stream import ReadDataStream
        from mcap.opcode import Opcode

        stream = ReadDataStream(io.BytesIO(data))
        if opcode == Opcode.SCHEMA:
            schema = records.Schema.read(stream)
            self._schemas.setdefault(schema.id, schema)
        else:
            channel = records.Channel.read(stream)
            self._channels.setdefault(channel.id, channel)

    def _add_chunk(self, chunk: Chunk, position: int, length: int) -> None:
        from mcap import records
        from mcap.opcode import Opcode

        data = chunk_data(chunk.compression, chunk.data, chunk.uncompressed_size)
        if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
            raise BagFormatError("not a whole MCAP file: a chunk's checksum is wrong")
        size = len(data)
        entries: _Entries = {}
        at = 0
        while at < size:
            opcode, content_size = _HEAD.unpack_from(data, at)
            start = at + _HEAD.size
            if start + content_size > size:
                raise BagFormatError("a record does not fit into its chunk")
            if opcode == Opcode.MESSAGE:
                channel, _, time = _MESSAGE.unpack_from(data, start)
                entries.setdefault(channel, []).append((time, at))
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._add_definition(opcode, data[start : start + content_size])
            at = start + content_size

        self._entries = entries
        index = records.ChunkIndex(
            chunk_length=length,
            chunk_start_offset=position,
            compression=chunk.compression,
            compressed_size=len(chunk.data),
            message_end_time=chunk.message_end_time,
            message_index_length=0,
            message_index_offsets={},
            message_start_time=chunk.message_start_time,
            uncompressed_size=chunk.uncompressed_size,
        )
        counts = Counter({channel: len(each) for channel, each in entries.items()})
        self._chunks.append(_Recovered(index, counts, position + length))

    def _add_message_index(self, record: MessageIndex, position: int, length: int) -> None:
        if not self._entries:
            return
        last = self._chunks[-1].info
        if sorted(record.records) == sorted(self._entries.get(record.channel_id, ())):
            last.message_index_offsets[record.channel_id] = position
            last.message_index_length = position + length - last.chunk_start_offset - last.chunk_length
        if len(last.message_index_offsets) == len(self._entries):
            self._entries = {}

    def _message_indexes(self) -> bytes:
        """Rebuild the last chunk's message indexes, which are incomplete, and enter their offsets in its ChunkIndex record."""
        from mcap.data_stream import RecordBuilder
        from mcap.records import MessageIndex

        last, _, self._end = self._chunks[-1]
        builder = RecordBuilder()
        last.message_index_offsets.clear()
        for channel, entries in self._entries.items():
            last.message_index_offsets[channel] = self._end + builder.count
            MessageIndex(channel, entries).write(builder)
        last.message_index_length = builder.count
        return bytes(builder.end())  # type: ignore[no-untyped-call]

    def _write(self, tail: bytes) -> None:
        """Write the end of the file at the stream's position: ``tail``, the summary, and the footer."""
        from mcap.data_stream import RecordBuilder
        from mcap.opcode import Opcode
        from mcap.records import DataEnd, Footer, SummaryOffset

        builder = RecordBuilder()
        builder.write(tail)
        DataEnd(0).write(builder)
        start = self._end + builder.count
        head = bytes(builder.end())  # type: ignore[no-untyped-call]

        builder = RecordBuilder()
        offsets = []
        for opcode, group in (
            (Opcode.SCHEMA, self._schemas.values()),
            (Opcode.CHANNEL, self._channels.values()),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, [chunk.info for chunk in self._chunks]),
            (Opcode.ATTACHMENT_INDEX, [each for each in self._attachments if each.offset < self._end]),
            (Opcode.METADATA_INDEX, [each for each in self._metadata if each.offset < self._end]),
        ):
            before = builder.count
            for record in group:
                record.write(builder)
            if builder.count > before:
                offsets.append(
                    SummaryOffset(
                        group_opcode=opcode, group_start=start + before, group_length=builder.count - before
                    )
                )
        offset_start = start + builder.count
        for offset in offsets:
            offset.write(builder)
        summary = bytes(builder.end())  # type: ignore[no-untyped-call]

        # The checksum covers the summary, and the footer up to the checksum.
        footer = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offset_start)
        Footer(start, offset_start, zlib.crc32(footer, zlib.crc32(summary))).write(builder)
        data = memoryview(head + summary + bytes(builder.end()) + MAGIC)  # type: ignore[no-untyped-call]
        while data:
            data = data[self._stream.write(data) :]

    def _statistics(self) -> Statistics:
        from mcap.records import Statistics

        counts: Counter[int] = Counter()
        for chunk in self._chunks:
            counts.update(chunk.counts)
        times = [(chunk.info.message_start_time, chunk.info.message_end_time) for chunk in self._chunks]
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=dict(counts),
            chunk_count=len(self._chunks),
            message_count=counts.total(),
            message_end_time=max((end for _, end in times), default=0),
            message_start_time=min((start for start, _ in times), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )
