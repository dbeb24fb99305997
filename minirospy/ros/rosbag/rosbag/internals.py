"""The private parts of rosbag.bag: records as objects, used by rqt_bag and other programs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from minirospy.base.errors import DefinitionError
from minirospy.introspect.bags import class_of
from minirospy.ros.rosbag.rosbag.exceptions import ROSBagException, ROSBagFormatException

if TYPE_CHECKING:
    from minirospy.client.time import Time
    from minirospy.core.bag.chunks import StoredChunk
    from minirospy.core.bag.index import ConnectionIndex, Entry
    from minirospy.core.bag.records import ChunkInfo, Connection
    from minirospy.core.idl.protocols import Message

__all__ = ["Header", "make_time"]

Header = dict[str, bytes] | dict[str, str]


def make_time() -> Callable[[int], Time]:
    """Return a function that creates a rospy.Time from nanoseconds, faster than the constructor."""
    from minirospy.client.time import Time

    new = Time.__new__

    def make(nanoseconds: int) -> Time:
        time = new(Time)
        time.secs, time.nsecs = divmod(nanoseconds, 1_000_000_000)
        return time

    return make


class _ConnectionInfo:
    """A connection: ``id``, ``topic``, the fields of its header, and the ``header`` itself."""

    def __init__(self, id: int, topic: str, header: Header) -> None:
        fields = {
            name: value if isinstance(value, str) else value.decode("utf-8", "replace")
            for name, value in header.items()
        }
        for name in ("type", "md5sum", "message_definition"):
            if name not in fields:
                raise ROSBagFormatException(f'expected "{name}" field in record')
        self.id = id
        self.topic = topic
        self.datatype = fields["type"]
        self.md5sum = fields["md5sum"]
        self.msg_def = fields["message_definition"]
        self.header = header

    @classmethod
    def of(cls, connection: Connection) -> _ConnectionInfo:
        """Create a _ConnectionInfo from a connection of minirospy's reader."""
        return cls(connection.id, connection.topic, connection.header)

    def __str__(self) -> str:
        return f"{self.id} on {self.topic}: {self.header}"


class _ChunkInfo:
    """A chunk: its position ``pos``, start and end time, and message counts per connection."""

    def __init__(self, pos: int, start_time: Time, end_time: Time) -> None:
        self.pos = pos
        self.start_time = start_time
        self.end_time = end_time
        self.connection_counts: dict[int, int] = {}

    @classmethod
    def of(cls, chunk: ChunkInfo) -> _ChunkInfo:
        """Create a _ChunkInfo from a chunk of minirospy's reader."""
        make = make_time()
        info = cls(chunk.position, make(chunk.start_time), make(chunk.end_time))
        info.connection_counts = chunk.counts
        return info

    def __str__(self) -> str:
        lines = [
            f"chunk_pos:   {self.pos}",
            f"start_time:  {self.start_time}",
            f"end_time:    {self.end_time}",
            f"connections: {len(self.connection_counts)}",
        ]
        lines += [f"  - [{number:4}] {count}" for number, count in self.connection_counts.items()]
        return "\n".join(lines)


class _ChunkHeader:
    """A chunk's header, with the position of its data."""

    def __init__(
        self, compression: str, compressed_size: int, uncompressed_size: int, data_pos: int = 0
    ) -> None:
        self.compression = compression
        self.compressed_size = compressed_size
        self.uncompressed_size = uncompressed_size
        self.data_pos = data_pos

    @classmethod
    def of(cls, stored: StoredChunk) -> _ChunkHeader:
        """Create a _ChunkHeader from a chunk of minirospy's reader."""
        return cls(
            stored.chunk.compression, stored.chunk.compressed_size, stored.chunk.size, stored.data_position
        )

    def __str__(self) -> str:
        text = f"compression: {self.compression}, size: {self.compressed_size}, uncompressed: {self.uncompressed_size}"
        if not self.uncompressed_size:
            return text
        return f"{text} ({100 * self.compressed_size / self.uncompressed_size:.2f}%)"


class _IndexEntry:
    """A message's time and position. Entries compare by time. ``chunk_pos`` is None in version 1.2 bags."""

    __slots__ = ["chunk_pos", "offset", "time"]

    def __init__(self, time: Time, chunk_pos: int | None = None, offset: int = 0) -> None:
        self.time = time
        self.chunk_pos = chunk_pos
        self.offset = offset

    @property
    def position(self) -> int | tuple[int, int]:
        """Return the position in the format that Bag._read_message expects."""
        return self.offset if self.chunk_pos is None else (self.chunk_pos, self.offset)

    def __eq__(self, other: object) -> bool:
        return self.time == other.time if isinstance(other, _IndexEntry) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.time)

    def __lt__(self, other: _IndexEntry) -> bool:
        return self.time < other.time

    def __le__(self, other: _IndexEntry) -> bool:
        return self.time <= other.time

    def __gt__(self, other: _IndexEntry) -> bool:
        return self.time > other.time

    def __ge__(self, other: _IndexEntry) -> bool:
        return self.time >= other.time

    def __str__(self) -> str:
        place = f"{self.offset}" if self.chunk_pos is None else f"{self.chunk_pos}+{self.offset}"
        return f"{self.time.secs}.{self.time.nsecs}: {place}"


class _IndexEntry102(_IndexEntry):
    """An index entry in a version 1.2 bag: a message's time and file position."""

    __slots__ = ()

    def __init__(self, time: Time, offset: int) -> None:
        super().__init__(time, None, offset)


class _IndexEntry200(_IndexEntry):
    """An index entry in a version 2.0 bag: a message's time and its position in a chunk."""

    __slots__ = ()

    def __init__(self, time: Time, chunk_pos: int, offset: int) -> None:
        super().__init__(time, chunk_pos, offset)


class _Index(Sequence[_IndexEntry]):
    """A connection's index entries, created as objects on access."""

    def __init__(self, index: ConnectionIndex) -> None:
        self.source = index
        self._make_time = make_time()

    def __len__(self) -> int:
        return len(self.source)

    def __getitem__(self, at: int | slice) -> _IndexEntry | list[_IndexEntry]:  # type: ignore[override]
        if isinstance(at, slice):
            return [self.entry(self.source[each]) for each in range(*at.indices(len(self.source)))]
        if not -len(self) <= at < len(self):
            raise IndexError(at)
        return self.entry(self.source[at % len(self)])

    def entry(self, entry: Entry) -> _IndexEntry:
        """Create an _IndexEntry from an index entry of minirospy's reader."""
        return _IndexEntry(self._make_time(entry.time), entry.chunk, entry.offset)


_message_types: dict[str, type[Message]] = {}
"""Message classes keyed by md5sum. The name is the same as in ROS's rosbag."""


def _get_message_type(info: _ConnectionInfo) -> type[Message]:
    """Return the class for a connection's messages, built from the bag's definition.

    Raise ROSBagException if the definition is invalid.
    """
    found = _message_types.get(info.md5sum)
    if found is None:
        found = _message_types[info.md5sum] = _make_message_type(info)
    return found


def _make_message_type(info: _ConnectionInfo) -> type[Message]:
    try:
        return class_of(info.datatype, info.md5sum, info.msg_def, lambda line: print(line, file=sys.stderr))
    except DefinitionError as error:
        raise ROSBagException(f"Error generating datatype {info.datatype}: {error}") from error
