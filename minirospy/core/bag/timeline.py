"""A bag's timeline for display, not playback: message counts per interval, and the message at a given time."""

from __future__ import annotations

import operator
from array import array
from bisect import bisect_left, bisect_right
from itertools import islice
from typing import NamedTuple

from minirospy.core.bag.base import BagReader, StoredMessage
from minirospy.core.bag.records import Connection

__all__ = ["Timeline", "TopicTimes"]


class TopicTimes(NamedTuple):
    """A topic: its connections in the bag, and for each connection the sorted message times in nanoseconds."""

    name: str
    connections: list[Connection]
    times: list[array[int]]

    @property
    def messages(self) -> int:
        """The number of messages."""
        return sum(map(len, self.times))

    @property
    def is_latched(self) -> bool:
        """Return whether a publisher latched its last message."""
        return any(connection.latching for connection in self.connections)


class Timeline:
    """A bag's index by topic. ``topics`` is a dict from topic name to message times, for the topics that have messages.

    Raise BagFormatError if the index is damaged.
    """

    def __init__(self, reader: BagReader) -> None:
        self._reader = reader
        numbers = list(reader.connections)
        by_topic: dict[str, TopicTimes] = {}
        for number, times in zip(numbers, map(_in_order, reader.times(numbers)), strict=True):
            if times:
                connection = reader.connections[number]
                topic = by_topic.setdefault(connection.topic, TopicTimes(connection.topic, [], []))
                topic.connections.append(connection)
                topic.times.append(times)
        self.topics = dict(sorted(by_topic.items()))

    @property
    def span(self) -> tuple[int, int] | None:
        """Return the times of the first and the last message, or None if there are no messages."""
        every = [times for topic in self.topics.values() for times in topic.times]
        return (min(times[0] for times in every), max(times[-1] for times in every)) if every else None

    def density(self, topic: str, start: int, end: int, bins: int) -> list[int]:
        """Return a topic's message counts in ``bins`` equal parts of the time from ``start`` to ``end``, inclusive."""
        counts = [0] * bins
        borders = [start + (end + 1 - start) * number // bins for number in range(bins + 1)]
        for times in self.topics[topic].times:
            places = [bisect_left(times, border) for border in borders]
            for number in range(bins):
                counts[number] += places[number + 1] - places[number]
        return counts

    def message_at(self, topic: str, time: int) -> StoredMessage | None:
        """Return a topic's last message at or before ``time``. Raise BagFormatError if the bag is damaged."""
        newest: tuple[int, Connection] | None = None
        known = self.topics[topic]
        for connection, times in zip(known.connections, known.times, strict=True):
            at = bisect_right(times, time) - 1
            if at >= 0 and (newest is None or times[at] >= newest[0]):
                newest = times[at], connection
        if newest is None:
            return None

        when, connection = newest
        last = None
        for message in self._reader.messages([connection.id], when, when):
            last = message
        return last

    def time_at(self, topic: str, time: int) -> int | None:
        """Return the time of a topic's last message at or before ``time``."""
        found = [times[at - 1] for times in self.topics[topic].times if (at := bisect_right(times, time))]
        return max(found, default=None)

    def count_at(self, time: int) -> int:
        """Return the number of messages with exactly this time."""
        return sum(
            bisect_right(times, time) - bisect_left(times, time)
            for topic in self.topics.values()
            for times in topic.times
        )

    def time_after(self, time: int) -> int | None:
        """Return the time of the first message after ``time``, or None if there is none."""
        found = [
            times[at]
            for topic in self.topics.values()
            for times in topic.times
            if (at := bisect_right(times, time)) < len(times)
        ]
        return min(found, default=None)

    def time_before(self, time: int) -> int | None:
        """Return the time of the last message before ``time``, or None if there is none."""
        found = [
            times[at - 1]
            for topic in self.topics.values()
            for times in topic.times
            if (at := bisect_left(times, time))
        ]
        return max(found, default=None)


def _in_order(times: array[int]) -> array[int]:
    """Return times in order: a writer may store chunks, and messages in them, in any order."""
    return times if all(map(operator.le, times, islice(times, 1, None))) else array("Q", sorted(times))
