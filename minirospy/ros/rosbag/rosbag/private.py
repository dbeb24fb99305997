"""Attributes of rosbag.Bag that are private in the real module, but used by rqt_bag and other programs."""

from __future__ import annotations

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

from minirospy.base.names import canonicalize
from minirospy.base.times import Time
from minirospy.core.bag.compression import NONE
from minirospy.core.bag.index import merge_entries
from minirospy.ros.rosbag.rosbag.exceptions import as_ros_errors
from minirospy.ros.rosbag.rosbag.internals import (
    Header,
    _ChunkHeader,
    _ChunkInfo,
    _ConnectionInfo,
    _get_message_type,
    _Index,
    _IndexEntry,
    make_time,
)

if TYPE_CHECKING:
    from minirospy.client.time import Time as RospyTime
    from minirospy.core.bag.base import BagReader, Position
    from minirospy.core.idl.protocols import Message

__all__ = ["BagMessage", "BagMessageWithConnectionHeader", "ConnectionFilter", "PrivateBag", "nanoseconds_of"]

ConnectionFilter = Callable[[str, str, str, str, Header], object]


class BagMessage(NamedTuple):
    """A message with its topic and time. If ``raw``, the message is (type, bytes, md5sum, position, class)."""

    topic: str
    message: object
    timestamp: RospyTime


class BagMessageWithConnectionHeader(NamedTuple):
    """A message with its publisher's connection header."""

    topic: str
    message: object
    timestamp: RospyTime
    connection_header: Header


class PrivateBag(ABC):
    """Provides rosbag.Bag's private attributes."""

    _file: BinaryIO | None
    _connection_indexes_read = False  # whether the index has been read or will be when needed
    _chunks_of_program: Iterable[_ChunkInfo] | None = None
    """The chunks that a program has assigned to replace the bag's own, or None."""

    @abstractmethod
    def _current(self) -> BagReader:
        """Return a reader that includes the connections and chunks written so far."""

    @abstractmethod
    def flush(self) -> None:
        """Write the current chunk to the file."""

    @abstractmethod
    def read_messages(
        self,
        topics: str | Iterable[str] | None,
        start_time: Time | None,
        end_time: Time | None,
        connection_filter: ConnectionFilter | None,
        raw: bool,
        return_connection_header: bool,
    ) -> Iterator[Any]:
        """Yield messages in time order."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Return the file size in bytes."""

    @property
    def _connections(self) -> dict[int, _ConnectionInfo]:
        return {number: _ConnectionInfo.of(each) for number, each in self._current().connections.items()}

    @property
    def _chunks(self) -> Iterable[_ChunkInfo]:
        if self._chunks_of_program is not None:
            return self._chunks_of_program
        return list(map(_ChunkInfo.of, self._current().chunks))

    @_chunks.setter
    def _chunks(self, chunks: Iterable[_ChunkInfo]) -> None:
        self._chunks_of_program = chunks

    @property
    def _connection_count(self) -> int:
        return len(self._current().connections)

    @property
    def _chunk_count(self) -> int:
        return len(self._current().chunks)

    @property
    def _topic_connections(self) -> dict[str, _ConnectionInfo]:
        """Return each topic's newest connection, for use when writing."""
        return {connection.topic: connection for connection in self._connections.values()}

    def _clear_index(self) -> None:
        """Discard the chunks that a program has assigned."""
        self._chunks_of_program = None

    @contextlib.contextmanager
    def _position_kept(self) -> Iterator[None]:
        """Restore the file position after the block.

        The program may be reading records there; the real module has this data in memory.
        """
        position = self._file.tell() if self._file else 0
        yield
        if self._file:
            self._file.seek(position)

    @property
    def _chunk_headers(self) -> dict[int, _ChunkHeader]:
        with as_ros_errors(), self._position_kept():
            headers = self._current().chunk_headers()
        return {position: _ChunkHeader.of(each) for position, each in headers.items()}

    @property
    def _connection_indexes(self) -> dict[int, _Index]:
        numbers = list(self._current().connections)
        return dict(zip(numbers, self._indexes(numbers), strict=True))

    @property
    def _has_compressed_chunks(self) -> bool:
        return any(each.compression != NONE for each in self._chunk_headers.values())

    @property
    def _uncompressed_size(self) -> int:
        headers = self._chunk_headers.values()
        return sum(each.uncompressed_size for each in headers) if headers else self.size

    def _read_message(
        self, position: Position, raw: bool = False, return_connection_header: bool = False
    ) -> BagMessage | BagMessageWithConnectionHeader:
        """Return the message at a position, which has the format used in index entries and raw messages."""
        self.flush()
        with as_ros_errors():
            stored = self._current().message_at(position)
        connection = _ConnectionInfo.of(stored.connection)
        kind = _get_message_type(connection)
        message: Message | tuple[object, ...]
        if raw:
            message = (connection.datatype, stored.body, connection.md5sum, stored.position, kind)
        else:
            message = kind()
            message.deserialize(stored.body)
        stamp = make_time()(stored.time)
        if return_connection_header:
            return BagMessageWithConnectionHeader(connection.topic, message, stamp, connection.header)
        return BagMessage(connection.topic, message, stamp)

    def _get_connections(
        self,
        topics: str | Iterable[str] | None = None,
        connection_filter: ConnectionFilter | None = None,
    ) -> Iterator[_ConnectionInfo]:
        """Yield the connections on these topics that pass the filter."""
        wanted = {topics} - {""} if isinstance(topics, str) else set(topics or ())
        canonical = {canonicalize(topic) for topic in wanted if topic}
        for each in self._connections.values():
            if wanted and not {each.topic, canonicalize(each.topic)} & canonical:
                continue
            if connection_filter and not connection_filter(
                each.topic, each.datatype, each.md5sum, each.msg_def, each.header
            ):
                continue
            yield each

    def _get_entries(
        self,
        connections: Iterable[_ConnectionInfo] | None = None,
        start_time: Time | None = None,
        end_time: Time | None = None,
    ) -> Iterator[_IndexEntry]:
        """Yield these connections' index entries in time order."""
        return self._merged(connections, start_time, end_time, backwards=False)

    def _get_entries_reverse(
        self,
        connections: Iterable[_ConnectionInfo] | None = None,
        start_time: Time | None = None,
        end_time: Time | None = None,
    ) -> Iterator[_IndexEntry]:
        """Yield these connections' index entries in reverse time order."""
        return self._merged(connections, start_time, end_time, backwards=True)

    def _get_entry(self, t: Time, connections: Iterable[_ConnectionInfo] | None = None) -> _IndexEntry | None:
        """Return the last index entry at or before a time."""
        indexes = self._get_indexes(connections)
        found = [each.entry(last) for each in indexes if (last := each.source.last_until(t.to_nsec()))]
        return max(found, default=None)

    def _get_entry_after(
        self, t: Time, connections: Iterable[_ConnectionInfo] | None = None
    ) -> _IndexEntry | None:
        """Return the first index entry after a time."""
        indexes = self._get_indexes(connections)
        found = [each.entry(first) for each in indexes if (first := each.source.first_after(t.to_nsec()))]
        return min(found, default=None)

    def _get_indexes(self, connections: Iterable[_ConnectionInfo] | None) -> list[_Index]:
        numbers = self._current().connections if connections is None else [each.id for each in connections]
        return self._indexes(numbers)

    def _merged(
        self,
        connections: Iterable[_ConnectionInfo] | None,
        start_time: Time | None,
        end_time: Time | None,
        *,
        backwards: bool,
    ) -> Iterator[_IndexEntry]:
        start, end = nanoseconds_of(start_time), nanoseconds_of(end_time)
        indexes = self._get_indexes(connections)
        if not indexes:
            return iter(())
        parts = (each.source.between(start, end, backwards=backwards) for each in indexes)
        return map(indexes[0].entry, merge_entries(parts, backwards=backwards))

    def _indexes(self, numbers: Iterable[int]) -> list[_Index]:
        with as_ros_errors(), self._position_kept():
            return list(map(_Index, self._current().index(numbers)))


def nanoseconds_of(stamp: Time | None) -> int | None:
    """Convert a time limit to nanoseconds; return None for time 0, like the real module.

    Raise TypeError if the limit is not a rospy.Time.
    """
    if not stamp:
        return None
    if not isinstance(stamp, Time):
        hint = f": rospy.Time.from_sec({stamp})" if isinstance(stamp, (int, float)) else ""
        raise TypeError(f"start_time and end_time are of type rospy.Time, not {type(stamp).__name__}{hint}")
    return stamp.to_nsec()
