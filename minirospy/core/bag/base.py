"""Reading of bags, of any version."""

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
"""Where a message's record is: its chunk's position and its offset in there; in version 1.2 its position in the file."""


class StoredMessage(NamedTuple):
    """A message: its connection, the time of its reception in nanoseconds, its bytes, and its place."""

    connection: Connection
    time: int
    body: bytes
    position: Position


class Block(NamedTuple):
    """Messages that follow each other in the order of time, from one chunk.

    ``found`` are time, rank (the place of its connection among those that were wanted), offset of the record, and start
    and end of the body in ``data``. ``chunk`` is its position; None in bags of version 1.2.
    """

    chunk: int | None
    data: bytes
    found: Sequence[Found]


class BagReader(ABC):
    """The interface of the readers of each version."""

    version: int
    """200 for 2.0."""
    indexed = True
    """Whether the bag has an index, or was made to have one."""
    stream: BinaryIO
    connections: dict[int, Connection]
    chunks: Sequence[ChunkInfo]
    """The chunks in the order of the file; none in bags of version 1.2."""

    @property
    def version_name(self) -> str:
        """The version as `rosbag info` prints it."""
        return f"{self.version // 100}.{self.version % 100}" + ("" if self.indexed else " (unindexed)")

    def prepare(self) -> None:
        """Find the connections of a bag that has no index, as version 1.2 allows. Raise BagFormatError."""
        return

    @abstractmethod
    def blocks(
        self, connections: Sequence[int], start: int | None = None, end: int | None = None
    ) -> Iterator[Block]:
        """Yield what :meth:`messages` yields, in blocks: for those who read millions."""

    def messages(
        self, connections: Iterable[int] | None = None, start: int | None = None, end: int | None = None
    ) -> Iterator[StoredMessage]:
        """Yield the messages of these connections (None: all) from ``start`` to ``end`` in nanoseconds, both included.

        They come in the order of time; those of one time in the order of the connections. Raise BagFormatError if
        the bag is damaged, when the messages before the damage have been yielded.
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
        """Return the message at a position, as an entry or another message has it. Raise BagFormatError."""

    @abstractmethod
    def index(self, connections: Iterable[int]) -> list[ConnectionIndex]:
        """Return the indexes of these connections, and read those that have not been read. Raise BagFormatError."""

    def times(self, connections: Iterable[int]) -> list[array[int]]:
        """Return the times of the messages of these connections, in arrays for the caller to keep. Raise BagFormatError."""
        return [array("Q", index.times) for index in self.index(connections)]

    def chunk_headers(self) -> dict[int, StoredChunk]:
        """Return the headers of the chunks by their positions. Raise BagUnindexedError."""
        return {}

    def size(self) -> int:
        """Return the stream's size in bytes."""
        return size_of(self.stream)

    def close(self) -> None:
        """End what helps reading; the stream stays open."""
        return


class ScannedReader(BagReader):
    """A reader whose bag may lack an index, and is scanned instead."""

    @abstractmethod
    def scan(self) -> Iterator[int]:
        """Read the whole bag, and make its index; yield the positions that are read, to show the progress."""
