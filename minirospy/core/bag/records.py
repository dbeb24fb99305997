"""Parse bag records from bytes to named tuples.

A record is a header (its length, then fields ``name=value``, each with a length prefix) and data (its length, then
bytes). The field ``op`` specifies the kind of record. All numbers are little-endian; times are nanoseconds since 1970
here, and 32-bit seconds and nanoseconds in the file. Source: http://wiki.ros.org/Bags/Format/2.0.

Fields may be in any order, and unknown fields and records are skipped. `minirospy.core.bag.encoding` is the inverse.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

from minirospy.base.errors import BagEncryptedError, BagFormatError, NoBagError

__all__ = [
    "BAG_HEADER_SIZE",
    "MAGIC",
    "MAX_HEADER",
    "MAX_UINT32",
    "OP_BAG_HEADER",
    "OP_CHUNK",
    "OP_CHUNK_INFO",
    "OP_CONNECTION",
    "OP_INDEX_DATA",
    "OP_MESSAGE_DATA",
    "OP_MESSAGE_DEFINITION",
    "BagHeader",
    "Chunk",
    "ChunkInfo",
    "Connection",
    "Fields",
    "MessageData",
    "Record",
    "parse_bag_header",
    "parse_chunk_header",
    "parse_chunk_info",
    "parse_connection",
    "parse_fields",
    "parse_message_data",
    "parse_record",
    "parse_records",
    "read_record",
    "read_version",
    "to_nanoseconds",
]

MAGIC = b"#ROSBAG V2.0\n"
"""The first line of a version 2.0 bag."""

OP_MESSAGE_DEFINITION = 1  # this record exists only in version 1.2 bags
OP_MESSAGE_DATA = 2
OP_BAG_HEADER = 3
OP_INDEX_DATA = 4
OP_CHUNK = 5
OP_CHUNK_INFO = 6
OP_CONNECTION = 7

BAG_HEADER_SIZE = 4096
"""Total size in bytes of the bag header's fields and padding; constant, because the header is overwritten when the bag is
closed.
"""

# maximum bytes in a record's header; in version 1.2 bags, headers contain definitions
MAX_HEADER = 16 * 1024 * 1024

MAX_UINT32 = 0xFFFFFFFF
"""The maximum 32-bit size or time, such as a record's data size or a chunk's uncompressed size."""

_BILLION = 10**9
_OPS = {
    OP_MESSAGE_DEFINITION: "MSG_DEF",
    OP_MESSAGE_DATA: "MSG_DATA",
    OP_BAG_HEADER: "FILE_HEADER",
    OP_INDEX_DATA: "INDEX_DATA",
    OP_CHUNK: "CHUNK",
    OP_CHUNK_INFO: "CHUNK_INFO",
    OP_CONNECTION: "CONNECTION",
}

_UINT32 = struct.Struct("<I")
_UINT64 = struct.Struct("<Q")
_TIME = struct.Struct("<II")
_PAIR = struct.Struct("<II")

Fields = dict[str, bytes]
"""A header's fields. The values are bytes, because definitions are not always UTF-8."""


class BagHeader(NamedTuple):
    """The bag's first record: the index's position (0 if the bag was not closed), and the numbers of connections and chunks."""

    index_pos: int
    connection_count: int
    chunk_count: int


class Connection(NamedTuple):
    """A connection in the bag: its ``id``, its ``topic``, and the publisher's connection header."""

    id: int
    topic: str
    header: Fields

    @property
    def type(self) -> str:
        """The message type, such as ``std_msgs/String``."""
        return self._text("type")

    @property
    def md5sum(self) -> str:
        """The type's md5sum."""
        return self._text("md5sum")

    @property
    def definition(self) -> str:
        """The type's full text: its definition, and the definitions of all types that it uses."""
        return self._text("message_definition")

    @property
    def callerid(self) -> str:
        """The name of the publisher's node, or "" if it was not stored."""
        return self._text("callerid")

    @property
    def latching(self) -> bool:
        """Return whether the publisher latched its last message."""
        return self._text("latching") == "1"

    def _text(self, name: str) -> str:
        return self.header.get(name, b"").decode("utf-8", "replace")


class MessageData(NamedTuple):
    """A message: its connection's id, its receive time, its bytes."""

    connection: int
    time: int
    body: bytes


class Chunk(NamedTuple):
    """A chunk's header: its compression, and the sizes of its data in memory and in the file."""

    compression: str
    size: int
    compressed_size: int


class ChunkInfo(NamedTuple):
    """A chunk's info: its position, the times of its first and last message, and its number of messages per connection."""

    position: int
    start_time: int
    end_time: int
    counts: dict[int, int]


class Record(NamedTuple):
    """A record's header, and its data's position in the stream or buffer."""

    position: int
    op: int
    fields: Fields
    data_position: int
    data_size: int

    @property
    def end(self) -> int:
        """The position after the record."""
        return self.data_position + self.data_size

    def uint32(self, name: str) -> int:
        """Return a field as a 32-bit integer. Raise BagFormatError if the field is missing or does not have 4 bytes."""
        return int(self._number(name, _UINT32))

    def uint64(self, name: str) -> int:
        """Return a field as a 64-bit integer. Raise BagFormatError if the field is missing or does not have 8 bytes."""
        return int(self._number(name, _UINT64))

    def time(self, name: str) -> int:
        """Return a time field in nanoseconds. Raise BagFormatError if the field is missing or does not have 8 bytes."""
        value = self.field(name)
        if len(value) != 8:
            raise BagFormatError(f'error reading field "{name}": it has {len(value)} bytes', self.position)
        return to_nanoseconds(*_TIME.unpack(value))

    def text(self, name: str) -> str:
        """Return a field as a string. Raise BagFormatError if it is missing."""
        return self.field(name).decode("utf-8", "replace")

    def field(self, name: str) -> bytes:
        """Return a field's bytes. Raise BagFormatError if it is missing."""
        try:
            return self.fields[name]
        except KeyError:
            raise BagFormatError(f'expected "{name}" field in record', self.position) from None

    def expect(self, op: int) -> None:
        """Raise BagFormatError unless the record has this ``op``."""
        if self.op != op:
            found = _OPS.get(self.op, str(self.op))
            raise BagFormatError(f"Expected op code: {_OPS[op]}, got {found}", self.position)

    def _number(self, name: str, form: struct.Struct) -> int:
        value = self.field(name)
        if len(value) != form.size:
            raise BagFormatError(f'error reading field "{name}": it has {len(value)} bytes', self.position)
        number: int = form.unpack(value)[0]
        return number


def to_nanoseconds(seconds: int, nanoseconds: int) -> int:
    """Convert a record's time to nanoseconds."""
    return seconds * _BILLION + nanoseconds


def read_version(stream: BinaryIO) -> int:
    """Read a bag's first line; return its version, 200 for 2.0. Raise NoBagError if it is not a bag."""
    line = stream.readline(100)
    if not line.strip():
        raise NoBagError("empty file")

    text = line.rstrip().decode("ascii", "replace")
    name, _, version = text.rpartition(" V")
    major, dot, minor = version[:1], version[1:2], version[2:3]
    if not (name.startswith("#ROS") and dot == "." and _is_digit(major) and _is_digit(minor)):
        raise NoBagError("This does not appear to be a bag file")
    return int(major) * 100 + int(minor)


def read_record(stream: BinaryIO, limit: int) -> Record:
    """Read the header and data length of the record at the stream's position; leave the stream at the start of the data.

    ``limit`` is the stream's size. Raise BagFormatError if the record is damaged, or a length goes beyond ``limit``.
    """
    position = stream.tell()
    header_size = _read_length(stream, position)
    if header_size > MAX_HEADER or position + 8 + header_size > limit:
        raise BagFormatError(f"a record's header of {header_size} bytes does not fit", position)
    header = stream.read(header_size)
    if len(header) != header_size:
        raise BagFormatError(
            f"Error reading header: expecting {header_size} bytes, read {len(header)}", position
        )

    fields = parse_fields(header, position)
    size = _read_length(stream, position)
    record = Record(position, _op(fields, position), fields, position + 8 + header_size, size)
    if record.end > limit:
        raise BagFormatError(f"a record's data of {size} bytes does not fit", position)
    return record


def parse_record(buffer: bytes, position: int) -> Record:
    """Parse the record at a position in a buffer, such as a chunk's data. Raise BagFormatError if it is damaged."""
    limit = len(buffer)
    if position + 8 > limit or position < 0:
        raise BagFormatError("a record's header does not fit into its chunk", position)
    (header_size,) = _UINT32.unpack_from(buffer, position)
    at = position + 4 + header_size
    if at + 4 > limit:
        raise BagFormatError(
            f"a record's header of {header_size} bytes does not fit into its chunk", position
        )

    fields = parse_fields(buffer[position + 4 : at], position)
    (size,) = _UINT32.unpack_from(buffer, at)
    record = Record(position, _op(fields, position), fields, at + 4, size)
    if record.end > limit:
        raise BagFormatError(f"a record's data of {size} bytes does not fit into its chunk", position)
    return record


def parse_records(buffer: bytes, position: int = 0) -> Iterator[Record]:
    """Yield the records in a buffer. Raise BagFormatError at the first incomplete one."""
    while position < len(buffer):
        record = parse_record(buffer, position)
        yield record
        position = record.end


def parse_fields(header: bytes, position: int | None = None) -> Fields:
    """Parse a header (without its length prefix) into its fields.

    Raise BagFormatError if a field is damaged; the error contains ``position``.
    """
    fields: Fields = {}
    at, end = 0, len(header)
    while at < end:
        if at + 4 > end:
            raise BagFormatError("Error reading header field", position)
        (size,) = _UINT32.unpack_from(header, at)
        at += 4
        if at + size > end:
            raise BagFormatError(
                f"Error reading header field: expected {size} bytes, read {end - at}", position
            )
        name, separator, value = header[at : at + size].partition(b"=")
        if not separator:
            raise BagFormatError("Error reading header field", position)
        fields[name.decode("utf-8", "replace")] = value
        at += size
    return fields


def parse_bag_header(record: Record) -> BagHeader:
    """Parse a bag header record.

    Raise BagFormatError if the record is invalid, BagEncryptedError if it names an encryptor.
    """
    record.expect(OP_BAG_HEADER)
    if encryptor := record.fields.get("encryptor"):
        raise BagEncryptedError(encryptor.decode("utf-8", "replace"))
    return BagHeader(record.uint64("index_pos"), record.uint32("conn_count"), record.uint32("chunk_count"))


def parse_connection(record: Record, data: bytes) -> Connection:
    """Parse a connection record. Raise BagFormatError if it is invalid or lacks the type, md5sum or definition."""
    record.expect(OP_CONNECTION)
    header = parse_fields(data, record.position)
    for name in ("type", "md5sum", "message_definition"):
        if name not in header:
            raise BagFormatError(f'expected "{name}" field in record', record.position)
    return Connection(record.uint32("conn"), record.text("topic"), header)


def parse_message_data(record: Record, body: bytes) -> MessageData:
    """Parse a message record. Raise BagFormatError if it is invalid."""
    record.expect(OP_MESSAGE_DATA)
    return MessageData(record.uint32("conn"), record.time("time"), body)


def parse_chunk_header(record: Record) -> Chunk:
    """Parse a chunk record's header. Raise BagFormatError if the record is invalid."""
    record.expect(OP_CHUNK)
    return Chunk(record.text("compression"), record.uint32("size"), record.data_size)


def parse_chunk_info(record: Record, data: bytes) -> ChunkInfo:
    """Parse a chunk info record. Raise BagFormatError if it is invalid."""
    record.expect(OP_CHUNK_INFO)
    version, count = record.uint32("ver"), record.uint32("count")
    if version != 1:
        raise BagFormatError(f"Unknown chunk info record version: {version}", record.position)
    if len(data) < count * _PAIR.size:
        raise BagFormatError(
            f"a chunk info of {count} connections has only {len(data)} bytes", record.position
        )

    counts = dict(_PAIR.iter_unpack(data[: count * _PAIR.size]))
    return ChunkInfo(record.uint64("chunk_pos"), record.time("start_time"), record.time("end_time"), counts)


def _read_length(stream: BinaryIO, position: int) -> int:
    data = stream.read(4)
    if len(data) != 4:
        raise BagFormatError(f"expecting 4 bytes, read {len(data)}", position)
    length: int = _UINT32.unpack(data)[0]
    return length


def _op(fields: Fields, position: int) -> int:
    op = fields.get("op")
    if op is None:
        raise BagFormatError('expected "op" field in record', position)
    if len(op) != 1:
        raise BagFormatError(f'error reading field "op": it has {len(op)} bytes', position)
    return op[0]


def _is_digit(text: str) -> bool:
    return text.isascii() and text.isdigit()
