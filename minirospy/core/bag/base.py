"""The interface for reading bags of any version."""

from __future__ import annotations

from abc import ABC, abstractmethod
from array import array
from collections.abc import Iterable, Iterator, Sequence
from typing import BinaryIO, NamedTuple

from minirospy.core.bag.chunks import Found, StoredChunk, size_of
from minirospy.core.bag.index import ConnectionIndex
from minirospy.core.bag.records import ChunkInfo, Connection

__all__ = ["BagReader", "Block", "Position", "StoredMessage"]

Position = int | tuple[int, int]
"""A message's location: its chunk's position and its offset in the chunk or, in version 1.2, its position in the file."""


class StoredMessage(NamedTuple):
    """A stored message: connection, receive time in nanoseconds, bytes and location."""

    connection: Connection
    time: int
    body: bytes
    position: Position


class Block(NamedTuple):
    """Consecutive messages from one chunk, in time order.

    ``found`` contains a tuple for each message: time, rank (the index of its connection among the requested ones),
    record offset, and start and end of the body in ``data``. ``chunk`` is the chunk's position, or None in version 1.2
    bags.
    """

    chunk: int | None
    data: bytes
    found: Sequence[Found]


class BagReader(ABC):
    """The common interface of the readers for all versions."""

    version: int  # the format version times 100: 200 means 2.0
    indexed = True  # False if the bag has no index and none was rebuilt
    stream: BinaryIO
    connections: dict[int, Connection]
    chunks: Sequence[ChunkInfo]  # the chunks in file order; empty in version 1.2 bags

    @property
    def version_name(self) -> str:
        """The version in the format that `rosbag info` prints."""
        return f"{self.version // 100}.{self.version % 100}" + ("" if self.indexed else " (unindexed)")

    def prepare(self) -> None:
        """Find the connections in a bag without an index, which version 1.2 allows.

        Raise BagFormatError if the bag is damaged.
        """
        return

    @abstractmethod
    def blocks(
        self, connections: Sequence[int], start: int | None = None, end: int | None = None
    ) -> Iterator[Block]:
        """Yield the same messages as :meth:`messages`, in blocks, which is faster for millions of messages."""

    def messages(
        self, connections: Iterable[int] | None = None, start: int | None = None, end: int | None = None
    ) -> Iterator[StoredMessage]:
        """Yield the messages on these connections (None: all) from ``start`` to ``end`` (nanoseconds, inclusive).

        The messages are in time order; messages with equal times are in the order of the connections. If the bag is
        damaged, raise BagFormatError after yielding the messages before the damage.
        """
        self.prepare()
        wanted = list(self.connections if connections is None else connections)
        by_rank = [self.connections[number] for number in wanted]
        for chunk, data, found in self.blocks(wanted, start, end):
            for time, rank, at, body, after in found:
                position = at if chunk is None else (chunk, at)
                yield StoredMessage(by_rank[rank], time, data[body:after], position)

    @abstractmethod
    def message_at(self, position: Position) -> StoredMessage:
        """Return the message at a position taken from an index entry or from another message.

        Raise BagFormatError if there is none.
        """

    @abstractmethod
    def index(self, connections: Iterable[int]) -> list[ConnectionIndex]:
        """Return the indexes of these connections. Indexes that are not in memory yet are read from the file.

        Raise BagFormatError if the bag is damaged.
        """

    def times(self, connections: Iterable[int]) -> list[array[int]]:
        """Return the times of these connections' messages, in arrays that the caller may keep.

        Raise BagFormatError if the bag is damaged.
        """
        return [array("Q", index.times) for index in self.index(connections)]

    def chunk_headers(self) -> dict[int, StoredChunk]:
        """Return a dict from chunk position to chunk header. Raise BagUnindexedError if a header is damaged."""
        return {}

    def size(self) -> int:
        """Return the stream's size in bytes."""
        return size_of(self.stream)

    def close(self) -> None:
        """Release the reader's resources, such as threads; the stream stays open."""
        return


class ScannedReader(BagReader):
    """A reader for bags that may lack an index. If the index is missing, the reader scans the bag to build one."""

    @abstractmethod
    def scan(self) -> Iterator[int]:
        """Build the index by reading the whole bag. Yield the positions while reading, to show the progress."""
