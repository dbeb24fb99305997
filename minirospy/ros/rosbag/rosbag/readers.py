"""The classes of rosbag.Bag's ``_reader``. Programs use them to read single messages or show the indexing progress."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, BinaryIO

from minirospy.ros.rosbag.rosbag import records
from minirospy.ros.rosbag.rosbag.internals import _ChunkHeader, _ChunkInfo, _ConnectionInfo

if TYPE_CHECKING:
    from minirospy.base.times import Time
    from minirospy.core.bag.base import Position
    from minirospy.ros.rosbag.rosbag.opening import OpenedBag
    from minirospy.ros.rosbag.rosbag.private import (
        BagMessage,
        BagMessageWithConnectionHeader,
        ConnectionFilter,
    )

__all__: list[str] = []


class _BagReader:
    """Reads ``bag``, in any format version."""

    def __init__(self, bag: OpenedBag) -> None:
        self.bag = bag

    def seek_and_read_message_data_record(
        self, position: Position, raw: bool, return_connection_header: bool = False
    ) -> BagMessage | BagMessageWithConnectionHeader:
        """Return the message at an index entry's position. Raise ROSBagException if it cannot be read."""
        return self.bag._read_message(position, raw, return_connection_header)

    def read_messages(
        self,
        topics: str | Iterable[str] | None,
        start_time: Time | None,
        end_time: Time | None,
        connection_filter: ConnectionFilter | None,
        raw: bool,
        return_connection_header: bool = False,
    ) -> Iterator[Any]:
        """Yield messages, like Bag.read_messages."""
        return self.bag.read_messages(
            topics, start_time, end_time, connection_filter, raw, return_connection_header
        )


class _BagReader200(_BagReader):
    """Reads a version 2.0 bag."""

    def prepare(self) -> None:
        """If a subclass overrides _read_connection_index_records(), call it now; otherwise the index is read on demand."""
        if type(self)._read_connection_index_records is not _BagReader200._read_connection_index_records:
            self._read_connection_index_records()

    def _read_connection_index_records(self) -> None:
        """Read the index. A subclass may first replace the bag's ``_chunks`` with an iterable that counts them."""
        for _ in self.bag._chunks:
            # The first iteration reads the whole index; the others only let a subclass's iterable count the chunks.
            if not self.bag._connection_indexes_read:
                self.bag._connection_indexes_read = self.bag._connection_indexes is not None

    def read_file_header_record(self) -> None:
        """Read the file header record at the file position."""
        records._read_header(self.bag._open_file(), records._OP_FILE_HEADER)
        records._skip_sized(self.bag._open_file())

    def read_chunk_header(self) -> _ChunkHeader:
        """Return the chunk header at the file position. Raise ROSBagFormatException if there is none."""
        file = self.bag._open_file()
        header = records._read_header(file, records._OP_CHUNK)
        compression = records._read_str_field(header, "compression")
        size = records._read_uint32_field(header, "size")
        compressed_size = records._read_uint32(file)
        return _ChunkHeader(compression, compressed_size, size, file.tell())

    def read_connection_record(self, f: BinaryIO, encrypt: bool = False) -> _ConnectionInfo:
        """Return the connection in the next record of ``f``.

        Raise ROSBagFormatException if the next record is not a connection.
        """
        header = records._read_header(f, records._OP_CONNECTION)
        number = records._read_uint32_field(header, "conn")
        topic = records._read_str_field(header, "topic")
        fields = records._read_header(f)
        return _ConnectionInfo(
            number, topic, {name: value.decode("utf-8", "replace") for name, value in fields.items()}
        )

    def read_chunk_info_record(self) -> _ChunkInfo:
        """Return the chunk info at the file position. Raise ROSBagFormatException if there is none."""
        file = self.bag._open_file()
        header = records._read_header(file, records._OP_CHUNK_INFO)
        info = _ChunkInfo(
            records._read_uint64_field(header, "chunk_pos"),
            records._read_time_field(header, "start_time"),
            records._read_time_field(header, "end_time"),
        )
        records._read_uint32(file)  # skip the message length, already included in the size
        for _ in range(records._read_uint32_field(header, "count")):
            number = records._read_uint32(file)
            info.connection_counts[number] = records._read_uint32(file)
        return info
