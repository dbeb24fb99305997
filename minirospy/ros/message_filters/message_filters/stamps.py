"""Queues of messages keyed by time stamp, and the search for sets of stamps that are close together. Pure."""

from __future__ import annotations

from bisect import bisect_left, bisect_right, insort
from collections.abc import Iterator, Mapping, MutableMapping, Sequence

from minirospy.base.times import Time

__all__ = ["StampQueue", "closest_stamps"]


class StampQueue(MutableMapping[Time, object]):
    """One input's messages, keyed by timestamp: a dict as in ROS, plus a sorted list of the stamps."""

    __slots__ = ("_entries", "order")

    def __init__(self, messages: Mapping[Time, object] | None = None) -> None:
        """Create a queue with the initial ``messages`` in order of arrival."""
        self.order: list[int] = []
        """Stamps in nanoseconds, ascending; always the same list object."""
        self._entries: dict[int, tuple[Time, object]] = {}
        if messages:
            self.update(messages)

    def __setitem__(self, stamp: Time, message: object) -> None:
        self.put(stamp.to_nsec(), stamp, message)

    def __getitem__(self, stamp: Time) -> object:
        return self._entries[stamp.to_nsec()][1]

    def __delitem__(self, stamp: Time) -> None:
        self.take(stamp.to_nsec())

    def __contains__(self, stamp: object) -> bool:
        return isinstance(stamp, Time) and stamp.to_nsec() in self._entries

    def __iter__(self) -> Iterator[Time]:
        return (stamp for stamp, _ in self._entries.values())

    def __len__(self) -> int:
        return len(self._entries)

    def __repr__(self) -> str:
        return repr(dict(self))

    def put(self, nanoseconds: int, stamp: Time, message: object) -> None:
        """Store a message under its stamp, given in nanoseconds and as a Time."""
        entries, order = self._entries, self.order
        if nanoseconds in entries:
            # Like a dict, keep an existing key's position and key object.
            stamp = entries[nanoseconds][0]
        elif order and nanoseconds < order[-1]:
            insort(order, nanoseconds)
        else:
            order.append(nanoseconds)
        entries[nanoseconds] = stamp, message

    def clear(self) -> None:
        """Remove every message."""
        self.order.clear()
        self._entries.clear()

    def take(self, nanoseconds: int) -> object:
        """Remove and return the message with this stamp in nanoseconds. Raise KeyError if there is no such message."""
        message = self._entries.pop(nanoseconds)[1]
        order = self.order
        del order[bisect_left(order, nanoseconds) if nanoseconds > order[0] else 0]
        return message

    def stamp_at(self, nanoseconds: int) -> Time:
        """Return the stored stamp object. Raise KeyError if there is no such stamp."""
        return self._entries[nanoseconds][0]

    def keep_newest(self, size: int) -> None:
        """Remove the oldest messages until at most ``size`` are left."""
        while len(self.order) > size:
            del self._entries[self.order.pop(0)]

    def nearest(self, stamp: int) -> int:
        """Return the stored stamp closest to ``stamp``; of two equally close ones, the first to arrive.

        Raise IndexError if empty.
        """
        order = self.order
        if order[-1] <= stamp:
            return order[-1]
        after = bisect_left(order, stamp)
        if after == 0 or order[after] == stamp:
            return order[after]
        earlier, later = order[after - 1], order[after]
        if stamp - earlier == later - stamp:
            return next(each for each in self._entries if each in (earlier, later))
        return earlier if stamp - earlier < later - stamp else later

    def between(self, first: int, last: int) -> list[int]:
        """Return the stamps from ``first`` to ``last``, ascending."""
        return self.order[bisect_left(self.order, first) : bisect_right(self.order, last)]

    def by_distance(self, stamps: Sequence[int], stamp: int) -> list[int]:
        """Sort some of the queue's stamps by distance to ``stamp``, keeping the order of arrival at equal distances."""
        ranks = {each: rank for rank, each in enumerate(self._entries)}
        return sorted(stamps, key=lambda each: (abs(each - stamp), ranks[each]))


def closest_stamps(
    queues: Sequence[StampQueue], stamp: int, slop: int, index: int | None = None
) -> list[int] | None:
    """Return one stamp from each queue such that all differ by less than ``slop``, or None if that is impossible.

    ``stamp`` is the new stamp, from queue number ``index``; the set contains it.

    The result is the set that ROS finds first. ROS tries all combinations of the stamps within ``slop`` of ``stamp``, closest
    first, with the first queue in the outermost loop. This function takes O(n log n) steps for n stamps, instead of the
    product over all queues. All values are in nanoseconds.
    """
    nearest = []
    for at, queue in enumerate(queues):
        order = queue.order
        if not order:
            return None
        if at == index:
            nearest.append(stamp)
        else:
            # Fast path for the most frequent case: the new message is newer than all others.
            nearest.append(newest if (newest := order[-1]) <= stamp else queue.nearest(stamp))
    first, last = min(nearest), max(nearest)
    if first < stamp - slop or last > stamp + slop:
        return None
    if last - first < slop:
        return nearest

    # Stamps that differ by less than `slop` fit into a window of that width, which starts at one of them.
    candidates = [
        [stamp] if at == index else queue.between(stamp - slop, stamp + slop)
        for at, queue in enumerate(queues)
    ]
    # The window must contain the new stamp, so it starts at or before that stamp.
    last = stamp + slop if index is None else stamp
    starts = {each for stamps in candidates for each in stamps if each <= last}
    windows = [start for start in sorted(starts) if _has_each(candidates, start, start + slop - 1)]

    chosen = []
    for queue, stamps in zip(queues, candidates, strict=True):
        # Choose the first stamp, in the order of by_distance, that is in a remaining window: ROS's loops find the same stamp.
        for each in queue.by_distance(stamps, stamp):
            if left := _around(windows, each, slop):
                windows = left
                chosen.append(each)
                break
        else:
            return None
    return chosen


def _around(windows: Sequence[int], stamp: int, slop: int) -> list[int]:
    """Return those of the windows, each given by its start, that contain ``stamp``."""
    return list(windows[bisect_right(windows, stamp - slop) : bisect_right(windows, stamp)])


def _has_each(candidates: Sequence[Sequence[int]], first: int, last: int) -> bool:
    """Return whether each queue has a stamp from ``first`` to ``last``."""
    for stamps in candidates:
        at = bisect_left(stamps, first)
        if at == len(stamps) or stamps[at] > last:
            return False
    return True
