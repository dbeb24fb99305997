"""rosbag.bag: read and write bags. Source: http://wiki.ros.org/rosbag/Code%20API.

Differences from the real module: opening a bag reads only its chunk infos, the index takes 16 bytes per message, and messages
are read in time order regardless of their order in the file. Two types on one topic get two connections.
"""

from __future__ import annotations

import os
import sys
import time
from collections import namedtuple
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypedDict

from minirospy.base.errors import BagCompressionError, BagError
from minirospy.core.bag import compression as compressions
from minirospy.core.bag import info
from minirospy.core.bag.base import ScannedReader
from minirospy.core.bag.info import _human_frequency as _human_readable_frequency
from minirospy.core.bag.info import _human_size as _human_readable_size
from minirospy.core.bag.reader import ChunkedReader
from minirospy.core.bag.repair import Repair
from minirospy.ros.rosbag.rosbag.exceptions import (
    ROSBagEncryptException,
    ROSBagEncryptNotSupportedException,
    ROSBagException,
    ROSBagFormatException,
    ROSBagUnindexedException,
    as_ros_errors,
    raise_as_ros,
)
from minirospy.ros.rosbag.rosbag.internals import _ChunkHeader as _ChunkHeader
from minirospy.ros.rosbag.rosbag.internals import _ChunkInfo as _ChunkInfo
from minirospy.ros.rosbag.rosbag.internals import _ConnectionInfo, _get_message_type
from minirospy.ros.rosbag.rosbag.internals import _IndexEntry as _IndexEntry
from minirospy.ros.rosbag.rosbag.internals import _IndexEntry102 as _IndexEntry102
from minirospy.ros.rosbag.rosbag.internals import _IndexEntry200 as _IndexEntry200
from minirospy.ros.rosbag.rosbag.internals import _message_types as _message_types
from minirospy.ros.rosbag.rosbag.opening import CLOSED, FileArgument, OpenedBag
from minirospy.ros.rosbag.rosbag.private import (
    BagMessage,
    BagMessageWithConnectionHeader,
    ConnectionFilter,
    nanoseconds_of,
)
from minirospy.ros.rosbag.rosbag.readers import _BagReader, _BagReader200
from minirospy.ros.rosbag.rosbag.records import _CHUNK_INDEX_VERSION as _CHUNK_INDEX_VERSION
from minirospy.ros.rosbag.rosbag.records import _FILE_HEADER_LENGTH as _FILE_HEADER_LENGTH
from minirospy.ros.rosbag.rosbag.records import _INDEX_VERSION as _INDEX_VERSION
from minirospy.ros.rosbag.rosbag.records import _OP_CHUNK as _OP_CHUNK
from minirospy.ros.rosbag.rosbag.records import _OP_CHUNK_INFO as _OP_CHUNK_INFO
from minirospy.ros.rosbag.rosbag.records import _OP_CODES as _OP_CODES
from minirospy.ros.rosbag.rosbag.records import _OP_CONNECTION as _OP_CONNECTION
from minirospy.ros.rosbag.rosbag.records import _OP_FILE_HEADER as _OP_FILE_HEADER
from minirospy.ros.rosbag.rosbag.records import _OP_INDEX_DATA as _OP_INDEX_DATA
from minirospy.ros.rosbag.rosbag.records import _OP_MSG_DATA as _OP_MSG_DATA
from minirospy.ros.rosbag.rosbag.records import _OP_MSG_DEF as _OP_MSG_DEF
from minirospy.ros.rosbag.rosbag.records import _VERSION as _VERSION
from minirospy.ros.rosbag.rosbag.records import _build_header_from_str as _build_header_from_str
from minirospy.ros.rosbag.rosbag.records import _decode_bytes as _decode_bytes
from minirospy.ros.rosbag.rosbag.records import _decode_str as _decode_str
from minirospy.ros.rosbag.rosbag.records import _median as _median
from minirospy.ros.rosbag.rosbag.records import _pack_time as _pack_time
from minirospy.ros.rosbag.rosbag.records import _pack_uint8 as _pack_uint8
from minirospy.ros.rosbag.rosbag.records import _pack_uint32 as _pack_uint32
from minirospy.ros.rosbag.rosbag.records import _pack_uint64 as _pack_uint64
from minirospy.ros.rosbag.rosbag.records import _peek_next_header_op as _peek_next_header_op
from minirospy.ros.rosbag.rosbag.records import _read as _read
from minirospy.ros.rosbag.rosbag.records import _read_bytes_field as _read_bytes_field
from minirospy.ros.rosbag.rosbag.records import _read_field as _read_field
from minirospy.ros.rosbag.rosbag.records import _read_header as _read_header
from minirospy.ros.rosbag.rosbag.records import _read_record_data as _read_record_data
from minirospy.ros.rosbag.rosbag.records import _read_sized as _read_sized
from minirospy.ros.rosbag.rosbag.records import _read_str_field as _read_str_field
from minirospy.ros.rosbag.rosbag.records import _read_time as _read_time
from minirospy.ros.rosbag.rosbag.records import _read_time_field as _read_time_field
from minirospy.ros.rosbag.rosbag.records import _read_uint8 as _read_uint8
from minirospy.ros.rosbag.rosbag.records import _read_uint8_field as _read_uint8_field
from minirospy.ros.rosbag.rosbag.records import _read_uint32 as _read_uint32
from minirospy.ros.rosbag.rosbag.records import _read_uint32_field as _read_uint32_field
from minirospy.ros.rosbag.rosbag.records import _read_uint64 as _read_uint64
from minirospy.ros.rosbag.rosbag.records import _read_uint64_field as _read_uint64_field
from minirospy.ros.rosbag.rosbag.records import _skip_record as _skip_record
from minirospy.ros.rosbag.rosbag.records import _skip_sized as _skip_sized
from minirospy.ros.rosbag.rosbag.records import _time_to_str as _time_to_str
from minirospy.ros.rosbag.rosbag.records import _unpack_time as _unpack_time
from minirospy.ros.rosbag.rosbag.records import _unpack_uint8 as _unpack_uint8
from minirospy.ros.rosbag.rosbag.records import _unpack_uint32 as _unpack_uint32
from minirospy.ros.rosbag.rosbag.records import _unpack_uint64 as _unpack_uint64
from minirospy.ros.rosbag.rosbag.records import _write_header as _write_header
from minirospy.ros.rosbag.rosbag.records import _write_record as _write_record
from minirospy.ros.rosbag.rosbag.records import _write_sized as _write_sized

if TYPE_CHECKING:
    from minirospy.base.times import Time
    from minirospy.core.idl.protocols import Message

__all__ = [
    "Bag",
    "BagMessage",
    "BagMessageWithConnectionHeader",
    "Compression",
    "ROSBagEncryptException",
    "ROSBagEncryptNotSupportedException",
    "ROSBagException",
    "ROSBagFormatException",
    "ROSBagUnindexedException",
    "_BagReader",
    "_BagReader200",
    "_ChunkHeader",
    "_ChunkInfo",
    "_ConnectionInfo",
    "_IndexEntry",
    "_get_message_type",
    "_human_readable_frequency",
    "_human_readable_size",
    "_message_types",
    "found_lz4",
]

found_lz4 = True  # always True here; programs check whether LZ4 is available


class Compression:
    """The chunk compression types that bags support."""

    NONE = compressions.NONE
    BZ2 = compressions.BZ2
    LZ4 = compressions.LZ4


CompressionTuple = namedtuple("CompressionTuple", ["compression", "uncompressed", "compressed"])
TopicTuple = namedtuple("TopicTuple", ["msg_type", "message_count", "connections", "frequency"])
TypesAndTopicsTuple = namedtuple("TypesAndTopicsTuple", ["msg_types", "topics"])


class _Pieces(list[bytes]):
    """A write-only buffer for a message's ``serialize``."""

    __slots__ = ()
    write = list.append


class Options(TypedDict, total=False):
    """The compression and size of chunks to be written."""

    compression: str
    chunk_threshold: int


class Bag(OpenedBag):
    """A bag open for reading, writing or appending.

    ``f`` is a path or an open binary file, which close() closes; ``mode`` is r, w or a; ``chunk_threshold`` is in bytes.
    ``allow_unindexed``: open a bag that was not closed, so that reindex() can be called. ``options`` may contain compression
    and chunk_threshold. ``skip_index``: show no rates in the info text. Raise ValueError if an argument is invalid,
    ROSBagException if the bag is invalid, OSError if the file cannot be opened.
    """

    def __init__(
        self,
        f: FileArgument,
        mode: str = "r",
        compression: str = Compression.NONE,
        chunk_threshold: int = 768 * 1024,
        allow_unindexed: bool = False,
        options: Options | None = None,
        skip_index: bool = False,
    ) -> None:
        if options is not None:
            if type(options) is not dict:
                raise ValueError("options must be of type dict")
            compression = options.get("compression", compression)
            chunk_threshold = options.get("chunk_threshold", chunk_threshold)
        super().__init__(mode, _checked_compression(compression), _checked_threshold(chunk_threshold))
        self._skip_index = skip_index
        self._written: dict[
            tuple[str, str], int
        ] = {}  # connection numbers of written messages, by topic and md5sum
        self._pieces = _Pieces()

        if not f:
            raise ValueError("filename (or stream) is invalid")
        self._open(f, mode, allow_unindexed)

    def _open(self, f: FileArgument, mode: str, allow_unindexed: bool) -> None:
        """Open the bag; called again after close()."""
        opening = {"r": self._open_read, "w": self._open_write, "a": self._open_append}
        if mode not in opening:
            raise ValueError(f'mode "{mode}" is invalid')
        self._mode = mode
        self._source, self._writer = None, None
        self._written.clear()
        self._clear_index()
        try:
            with as_ros_errors():
                opening[mode](f, allow_unindexed)
            self._create_reader()
            # minirospy reads the index on demand; a subclass may read it here to show the progress.
            if mode == "r" and not self._skip_index and isinstance(self._reader, _BagReader200):
                self._reader.prepare()
            self._connection_indexes_read = not self._skip_index
        except BaseException:
            self._version = None
            self._close_file()
            raise

    def __iter__(self) -> Iterator[BagMessage]:
        return self.read_messages()

    def __enter__(self) -> Bag:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def options(self) -> Options:
        """Return the compression and the chunk threshold as a dict."""
        return {"compression": self._compression, "chunk_threshold": self._chunk_threshold}

    @property
    def filename(self) -> str | os.PathLike[str] | None:
        """Return the given path, or None for a file object."""
        return self._filename

    @property
    def version(self) -> int | None:
        """Return the bag format version: 200 for 2.0."""
        return self._version

    @property
    def mode(self) -> str:
        """Return the bag's mode: r, w or a."""
        return self._mode

    @property
    def size(self) -> int:
        """Return the file size in bytes. Raise ValueError if the bag is closed."""
        stream = self._open_file()
        position = stream.tell()
        size = stream.seek(0, os.SEEK_END)
        stream.seek(position)
        return size

    @property
    def compression(self) -> str:
        """Return the compression of later chunks. Assigning an unknown compression raises ValueError."""
        return self._compression

    @compression.setter
    def compression(self, compression: str) -> None:
        compression = _checked_compression(compression)
        self.flush()
        self._compression = compression
        if self._writer:
            self._writer.compression = compression

    @property
    def chunk_threshold(self) -> int:
        """Return the uncompressed size in bytes at which a chunk is complete.

        Assigning a negative size raises ValueError.
        """
        return self._chunk_threshold

    @chunk_threshold.setter
    def chunk_threshold(self, chunk_threshold: int) -> None:
        chunk_threshold = _checked_threshold(chunk_threshold)
        self.flush()
        self._chunk_threshold = chunk_threshold
        if self._writer:
            self._writer.chunk_threshold = chunk_threshold

    def read_messages(
        self,
        topics: str | Iterable[str] | None = None,
        start_time: Time | None = None,
        end_time: Time | None = None,
        connection_filter: ConnectionFilter | None = None,
        raw: bool = False,
        return_connection_header: bool = False,
    ) -> Iterator[Any]:
        """Yield BagMessage(topic, message, timestamp) in time order.

        ``topics``: one or several; None or an empty list for all. ``start_time`` and ``end_time`` are inclusive;
        ``connection_filter(topic, type, md5sum, definition, header)`` selects connections. ``raw``: messages are tuples
        of type, bytes, md5sum, position and class. ``return_connection_header``: yield BagMessageWithConnectionHeader.
        Raise ValueError if the bag is closed, ROSBagException if the bag is damaged.
        """
        self.flush()
        self._current().prepare()
        connections = list(self._get_connections(topics, connection_filter))
        start, end = nanoseconds_of(start_time), nanoseconds_of(end_time)
        return self._read(connections, start, end, raw=raw, with_header=return_connection_header)

    def flush(self) -> None:
        """Write the current chunk to the file. Raise ValueError if the bag is closed."""
        stream = self._open_file()
        if self._writer:
            stream.seek(0, os.SEEK_END)
            with as_ros_errors():
                self._writer.flush()

    def write(
        self,
        topic: str,
        msg: Any,
        t: Time | None = None,
        raw: bool = False,
        connection_header: Mapping[str, str | bytes] | None = None,
    ) -> None:
        """Write a message received at time ``t`` (default: now).

        ``raw``: the message is a tuple of type, bytes, md5sum, (position,) and class. ``connection_header`` is stored
        with the first message for a topic and type. Raise ValueError if the bag is closed or an argument is invalid,
        ROSBagException if the message cannot be stored, OSError if writing fails.
        """
        if self._file is None:
            raise ValueError(CLOSED)
        if not topic:
            raise ValueError("topic is invalid")
        if not msg:
            raise ValueError("msg is invalid")
        writer = self._writer
        if writer is None:
            raise self._not_writable()
        nanoseconds = time.time_ns() if t is None else t.secs * 1_000_000_000 + t.nsecs
        if isinstance(topic, bytes):
            topic = topic.decode()

        if raw:
            if len(msg) not in (4, 5):
                raise ValueError("msg must be of length 4 or 5")
            body, md5sum = msg[1], msg[2]
        else:
            pieces = self._pieces
            pieces.clear()
            msg.serialize(pieces)
            body = pieces[0] if len(pieces) == 1 else b"".join(pieces)
            md5sum = msg._md5sum
        if type(body) is not bytes:
            # Serialize the body first: an invalid body must raise an error before anything is written to the chunk.
            body = body.encode() if isinstance(body, str) else bytes(memoryview(body))

        number = self._written.get((topic, md5sum))
        try:
            if number is None:
                header = connection_header or (
                    _raw_header(topic, msg[0], md5sum, msg[-1]) if raw else _header(topic, type(msg))
                )
                number = writer.add_connection(topic, header)
                self._written[topic, md5sum] = number
            if self._is_read:
                # A read since the last write may have moved the file position.
                self._file.seek(0, os.SEEK_END)
            writer.write(number, nanoseconds, body)
        except BagError as error:
            raise_as_ros(error)

    def _write_connection_record(self, connection_info: _ConnectionInfo, encrypt: bool = False) -> None:
        """Add a connection, to be used for later messages with the same topic and type."""
        if self._file is None:
            raise ValueError(CLOSED)
        if self._writer is None:
            raise self._not_writable()
        with as_ros_errors():
            number = self._writer.add_connection(connection_info.topic, connection_info.header)
        self._written[connection_info.topic, connection_info.md5sum] = number

    def reindex(self) -> Iterator[int]:
        """Rebuild the index. Yield the file position while reading, so that the caller can show the progress.

        If the bag was opened to append, data that cannot be recovered is cut off.
        """
        if self._version and self._version < 200:
            reader = self._source
            if isinstance(reader, ScannedReader):
                yield from reader.scan()
            return

        stream = self._open_file()
        repair = Repair(stream)
        with as_ros_errors():
            yield from repair.run()
            self._source = ChunkedReader(
                stream, repair.connections, repair.chunks, headers=dict(repair.headers)
            )
            if self._mode != "r":
                repair.apply()
                self._start_appending(repair.connections, repair.chunks, repair.end)

    def close(self) -> None:
        """Close the bag. Idempotent. Raise OSError if writing the end of the file fails."""
        if self._file is None:
            return
        try:
            if self._writer:
                self._file.seek(0, os.SEEK_END)
                with as_ros_errors():
                    self._writer.close()
        finally:
            self._close_file()

    def get_compression_info(self) -> CompressionTuple:
        """Return (compression, uncompressed, compressed): the most frequent compression and the total chunk sizes."""
        with as_ros_errors():
            stored = info.compression_of(self._current())
        name = stored[0].compression if stored else self.compression
        return CompressionTuple(
            name, sum(each.size for each in stored), sum(each.compressed_size for each in stored)
        )

    def get_message_count(self, topic_filters: str | list[str] | None = None) -> int:
        """Return the number of messages on all topics or on the given ones."""
        if topic_filters is not None:
            topics = self.get_type_and_topic_info(topic_filters).topics.values()
            return sum(topic.message_count for topic in topics)
        return self._summary(frequencies=False).messages

    def get_start_time(self) -> float:
        """Return the first message's time in seconds. Raise ROSBagException if there are no messages."""
        return self._times()[0]

    def get_end_time(self) -> float:
        """Return the last message's time in seconds. Raise ROSBagException if there are no messages."""
        return self._times()[1]

    def get_type_and_topic_info(self, topic_filters: str | list[str] | None = None) -> TypesAndTopicsTuple:
        """Return (msg_types, topics) for all topics, or for the given ones.

        ``msg_types`` maps types to md5sums, ``topics`` maps topics to (msg_type, message_count, connections, frequency).
        """
        if self._file is None and self._filename is not None:
            with Bag(self._filename, skip_index=self._skip_index) as bag:
                return bag.get_type_and_topic_info(topic_filters)
        summary = self._summary(frequencies=not self._skip_index)
        topics = {
            each.name: TopicTuple(each.type, each.messages, each.connections, each.frequency)
            for each in summary.topics
        }
        if topic_filters is not None:
            wanted = topic_filters if isinstance(topic_filters, list) else [topic_filters]
            connected = {each.topic for name in wanted for each in self._get_connections(name)}
            topics = {name: each for name, each in topics.items() if name in connected}
        return TypesAndTopicsTuple(dict(summary.types), topics)

    def set_encryptor(self, encryptor: str | None = None, param: str | None = None) -> None:
        """Accept None (no encryption). Raise ROSBagEncryptNotSupportedException for ``rosbag/AesCbcEncryptor``.

        Like the real module, raise ROSBagException if the bag already has chunks.
        """
        if self._current().chunks:
            raise ROSBagException("Cannot set encryptor after chunks are written")
        if encryptor == "rosbag/AesCbcEncryptor":
            raise ROSBagEncryptNotSupportedException(f"encryption by [{encryptor}] is not supported")

    def __str__(self) -> str:
        return info.as_text(self._summary(frequencies=not self._skip_index))

    def _get_yaml_info(self, key: str | None = None) -> str | None:
        """Return the info as YAML, or the value of a key such as ``topics[0].type`` (None: no such key)."""
        text = info.as_yaml(self._summary(frequencies=not self._skip_index))
        if not key:
            return text
        try:
            return info.value_of(text, key)
        except LookupError:
            print(f'Error getting key "{key}"', file=sys.stderr)
            return None

    def _create_reader(self) -> None:
        """Create ``_reader``, through which programs access the bag's internals. Subclasses may replace it."""
        self._reader = (_BagReader200 if self._version == 200 else _BagReader)(self)

    # -- internal -------------------------------------------------------------------------------------------------

    def _read(
        self,
        connections: Sequence[_ConnectionInfo],
        start: int | None,
        end: int | None,
        *,
        raw: bool,
        with_header: bool,
    ) -> Iterator[Any]:
        """Yield these connections' messages."""
        from minirospy.client.time import Time

        kinds: list[type[Message] | None] = [None] * len(connections)
        new_time, new_message, new_tuple = Time.__new__, object.__new__, tuple.__new__
        message: object
        try:
            for chunk, data, found in self._current().blocks([each.id for each in connections], start, end):
                for nanoseconds, rank, at, body, after in found:
                    connection = connections[rank]
                    kind = kinds[rank]
                    if kind is None:
                        kind = kinds[rank] = _get_message_type(connection)
                    # Create the message without its slow constructor; deserialize() sets every field.
                    if raw:
                        position = at if chunk is None else (chunk, at)
                        message = connection.datatype, data[body:after], connection.md5sum, position, kind
                    else:
                        message = new_message(kind)
                        message.deserialize(data[body:after])
                    stamp = new_time(Time)
                    stamp.secs, stamp.nsecs = divmod(nanoseconds, 1_000_000_000)
                    if with_header:
                        yield BagMessageWithConnectionHeader(
                            connection.topic, message, stamp, connection.header
                        )
                    else:
                        yield new_tuple(BagMessage, (connection.topic, message, stamp))
        except BagError as error:
            raise_as_ros(error)

    def _summary(self, *, frequencies: bool) -> info.Summary:
        # In the real module, this data remains in memory after close(); here, reopen the bag to read it.
        if self._file is None and self._filename is not None:
            with Bag(self._filename, skip_index=True) as bag:
                return bag._summary(frequencies=frequencies)
        path = None if self._filename is None else os.fspath(self._filename)
        if self._writer:
            self.flush()
        with as_ros_errors():
            return info.summarize(self._current(), path, frequencies=frequencies)

    def _times(self) -> tuple[float, float]:
        summary = self._summary(frequencies=False)
        if summary.start is None or summary.end is None:
            raise ROSBagException("Bag contains no message")
        return summary.start, summary.end


def _checked_compression(compression: str) -> str:
    try:
        compressions.check_compression(compression)
    except BagCompressionError as error:
        text = f"compression must be one of: {', '.join(compressions.COMPRESSIONS)}"
        if compression in compressions.COMPRESSIONS:
            text = str(error)
        raise ValueError(text) from error
    return compression


def _checked_threshold(threshold: int) -> int:
    if threshold < 0:
        raise ValueError("chunk_threshold must be greater than or equal to zero")
    return threshold


def _header(topic: str, kind: type[Message]) -> dict[str, str]:
    return {
        "topic": topic,
        "type": kind._type,
        "md5sum": kind._md5sum,
        "message_definition": kind._full_text,
    }


def _raw_header(topic: str, type_: str, md5sum: str, kind: type[Message] | None) -> dict[str, str]:
    if kind is None:
        from minirospy.core.idl.load import get_message_class

        kind = get_message_class(type_)
    if kind is None:
        raise ROSBagException(f"cannot locate message class and no message class provided for [{type_}]")
    if kind._md5sum != md5sum:
        print(
            f"WARNING: md5sum of loaded type [{type_}] does not match that specified",
            file=sys.stderr,
        )
    return _header(topic, kind) | {"type": type_, "md5sum": md5sum}
