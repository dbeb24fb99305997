"""A bag's index: the times and locations of each connection's messages, 16 bytes per message.

The index is read on demand from the index records after the chunks; reading messages in time order does not need it.
"""

from __future__ import annotations

import sys
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator
from heapq import merge
from typing import BinaryIO, NamedTuple

from minirospy.base.errors import BagFormatError
from minirospy.core.bag import records
from minirospy.core.bag.records import Record

__all__ = ["ConnectionIndex", "Entry", "merge_entries", "read_entries"]

_ENTRY_SIZE = 12


class Entry(NamedTuple):
    """A message's time and location: its chunk's position, and its record's offset in the chunk's data.

    In version 1.2 bags, which have no chunks, ``chunk`` is None and ``offset`` is the position in the file.
    """

    time: int
    chunk: int | None
    offset: int


class ConnectionIndex:
    """The index entries for one connection, in time order."""

    __slots__ = ("_chunks", "_offsets", "_places", "times")

    def __init__(self) -> None:
        self.times = array("Q")
        self._chunks: list[int] = []
        self._places = array("I")
        self._offsets = array("I")

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, at: int) -> Entry:
        chunk = self._chunks[self._places[at]] if self._chunks else None
        return Entry(self.times[at], chunk, self._offsets[at])

    def __iter__(self) -> Iterator[Entry]:
        return map(self.__getitem__, range(len(self.times)))

    def __reversed__(self) -> Iterator[Entry]:
        return map(self.__getitem__, reversed(range(len(self.times))))

    def extend(self, times: Iterable[int], offsets: Iterable[int], chunk: int | None = None) -> None:
        """Append the entries for a chunk, or for the whole bag if it has no chunks."""
        times = list(times)
        count = len(times)
        if not count:
            return
        in_order = (not self.times or self.times[-1] <= times[0]) and times == sorted(times)

        if chunk is None and self._offsets.typecode != "Q":
            self._offsets = array("Q", self._offsets)
        self.times.extend(times)
        self._offsets.extend(array(self._offsets.typecode, offsets))
        if chunk is not None:
            if not self._chunks or self._chunks[-1] != chunk:
                self._chunks.append(chunk)
            self._places.extend([len(self._chunks) - 1] * count)
        if not in_order:
            self._sort()

    def last_until(self, time: int) -> Entry | None:
        """Return the last entry whose time is at most ``time``."""
        at = bisect_right(self.times, time) - 1
        return self[at] if at >= 0 else None

    def first_after(self, time: int) -> Entry | None:
        """Return the first entry whose time is greater than ``time``."""
        at = bisect_right(self.times, time)
        return self[at] if at < len(self.times) else None

    def between(
        self, start: int | None = None, end: int | None = None, *, backwards: bool = False
    ) -> Iterator[Entry]:
        """Yield the entries from time ``start`` to ``end``, inclusive."""
        first = 0 if start is None else bisect_left(self.times, start)
        last = len(self.times) if end is None else bisect_right(self.times, end)
        places = range(first, last)
        return map(self.__getitem__, reversed(places) if backwards else places)

    def _sort(self) -> None:
        order = sorted(range(len(self.times)), key=self.times.__getitem__)
        self.times = array("Q", map(self.times.__getitem__, order))
        self._offsets = array(self._offsets.typecode, map(self._offsets.__getitem__, order))
        if self._chunks:
            self._places = array("I", map(self._places.__getitem__, order))


def read_entries(stream: BinaryIO, record: Record) -> tuple[array[int], array[int]]:
    """Read the data of a version 2.0 index record: times and offsets. Leave the stream at the end of the record.

    The data's size is computed from the number of entries, because ROS C Turtle wrote a wrong length. Raise BagFormatError
    if the record is damaged.
    """
    record.expect(records.OP_INDEX_DATA)
    if (version := record.uint32("ver")) != 1:
        raise BagFormatError(f"expecting index version 1, got {version}", record.position)
    size = record.uint32("count") * _ENTRY_SIZE
    stream.seek(record.data_position)
    data = stream.read(size)
    if len(data) != size:
        raise BagFormatError(f"expecting {size} bytes, read {len(data)}", record.data_position)

    numbers = array("I", data)
    if sys.byteorder == "big":
        numbers.byteswap()
    times = array(
        "Q", [seconds * 10**9 + rest for seconds, rest in zip(numbers[::3], numbers[1::3], strict=True)]
    )
    return times, numbers[2::3]


def merge_entries(indexes: Iterable[Iterable[Entry]], *, backwards: bool = False) -> Iterator[Entry]:
    """Yield the entries of several connections in time order; entries with equal times are in the order of ``indexes``."""
    return merge(*indexes, key=_time, reverse=backwards)


def _time(entry: Entry) -> int:
    return entry.time
