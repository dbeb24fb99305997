"""Read numeric fields from a bag for a plot, without playing the bag: exact points, or the extremes per pixel column.

A bag of any size is read chunk by chunk, so that memory is needed only for the result. Times are seconds since the start of the
bag.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import BagFormatError, MessageException, NotFoundError
from minirospy.core.bag.base import BagReader
from minirospy.core.bag.records import Connection
from minirospy.introspect.bags import class_of_connection
from minirospy.introspect.field_series import Step, parse_steps, select

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message

__all__ = [
    "BagTopic",
    "Budget",
    "FieldPath",
    "Point",
    "Sampler",
    "bag_span",
    "bag_topics",
    "differences",
    "field_path",
    "points",
    "sample",
]

MAX_EXACT = 20_000  # maximum number of points returned unchanged per series; the page draws at most 6,000
MAX_POINTS = 2_000_000  # maximum number of points that a request, with all its series, stores unchanged, at 16 bytes each
MAX_SERIES = 200  # maximum number of series per request
MAX_LABELS = 50  # maximum number of series per path; nested slices could select more
_SECOND = 10**9


class BagTopic(NamedTuple):
    """A topic in a bag, with the type and definition of its first connection."""

    name: str
    type: str
    definition: str


class FieldPath(NamedTuple):
    """The path of a plotted field in a bag: the topic, and the steps to a number in its messages."""

    topic: str
    steps: Sequence[Step]


class Point(NamedTuple):
    """A number in a message: the label of its series, the time in seconds since the start of the bag, and the value."""

    label: str
    time: float
    value: float


def bag_span(reader: BagReader) -> tuple[int, int]:
    """Return the times of a bag's first and last message in nanoseconds, or (0, 0) if it has no messages.

    Chunks may be stored out of order. Raise BagFormatError if the bag is damaged.
    """
    if reader.chunks:
        # A chunk without messages has times of 0. In an MCAP file, the chunks' message counts are unknown.
        starts = [chunk.start_time for chunk in reader.chunks if chunk.end_time]
        ends = [chunk.end_time for chunk in reader.chunks if chunk.end_time]
    else:
        times = [each for each in reader.times(reader.connections) if each]
        starts, ends = [min(each) for each in times], [max(each) for each in times]
    return min(starts, default=0), max(ends, default=0)


def bag_topics(reader: BagReader) -> list[BagTopic]:
    """Return the topics in a bag, sorted by name."""
    found: dict[str, BagTopic] = {}
    for each in reader.connections.values():
        found.setdefault(each.topic, BagTopic(each.topic, each.type, each.definition))
    return [found[name] for name in sorted(found)]


def field_path(path: str, topics: Iterable[str]) -> FieldPath:
    """Split the path of a plotted field, such as /joint_states/position[elbow], after the longest matching topic name.

    Raise NotFoundError if no topic matches, UsageError if the syntax of the rest is invalid.
    """
    known = sorted(topics)
    fitting = [each for each in known if path.startswith(each) and path[len(each) :][:1] in ("", *"/.[{")]
    if not fitting:
        raise NotFoundError("topic", path, known, f"the bag has {', '.join(known) or 'no topic'}")
    topic = max(fitting, key=len)
    return FieldPath(topic, parse_steps(path[len(topic) :]))


def points(
    reader: BagReader,
    paths: Sequence[FieldPath],
    start: float | None = None,
    end: float | None = None,
    on_time: Callable[[float], object] = lambda time: None,
) -> Iterator[tuple[int, Point]]:
    """Yield the numbers at the given paths in time order, each with the index of its path.

    ``start`` and ``end``: seconds since the start of the bag, inclusive. ``on_time`` is called after each chunk, with the time
    reached. Raise BagFormatError if the bag is damaged or a message cannot be deserialized.
    """
    origin = bag_span(reader)[0]
    of_topic: dict[str, list[int]] = {}
    for number, path in enumerate(paths):
        of_topic.setdefault(path.topic, []).append(number)
    wanted = [each for each in reader.connections.values() if each.topic in of_topic]
    if not wanted:
        return
    classes: list[type[Message] | None] = [None] * len(wanted)
    first, last = (None if each is None else origin + round(each * _SECOND) for each in (start, end))
    blocks = reader.blocks(
        [each.id for each in wanted], None if first is None else max(first, 0), last and max(last, 0)
    )
    for _, data, found in blocks:
        on_time((found[0][0] - origin) / _SECOND)
        for nanoseconds, rank, _, body, after in found:
            message_class = classes[rank]
            if message_class is None:
                message_class = classes[rank] = class_of_connection(wanted[rank], _ignore)
            message = _message(message_class, data[body:after], wanted[rank])
            time = (nanoseconds - origin) / _SECOND
            for number in of_topic[wanted[rank].topic]:
                path = paths[number]
                for label, value in select(message, path.steps, path.topic):
                    yield number, Point(label, time, value)


def _message(message_class: type[Message], body: bytes, connection: Connection) -> Message:
    message = message_class()
    try:
        message.deserialize(body)
    except MessageException as error:
        raise BagFormatError(
            f"a message on {connection.topic} does not match its definition: {error}"
        ) from error
    return message


def _ignore(_: str) -> None:
    """Ignore a definition that does not match its md5sum, so that as many messages as possible are read."""


def differences(minuend: Iterable[Point], subtrahend: Iterable[Point]) -> Iterator[Point]:
    """Yield the minuend minus the subtrahend, at the minuend's times; the subtrahend is interpolated linearly.

    Both must be in time order. Times outside the range of the second series are left out. If a path has several series, only the
    first one is used.
    """
    others = _first_series(subtrahend)
    before = after = next(others, None)
    for label, time, value in _first_series(minuend):
        while after is not None and after.time < time:
            before, after = after, next(others, None)
        if before is None or after is None:
            return
        if before.time > time:
            continue
        share = (time - before.time) / (after.time - before.time) if after.time > before.time else 1.0
        # At exactly this time, do not interpolate, because the point before may be NaN.
        other = after.value if share == 1.0 else before.value + share * (after.value - before.value)
        yield Point(f"{label} - {after.label}", time, value - other)


def _first_series(found: Iterable[Point]) -> Iterator[Point]:
    label = None
    for point in found:
        if label is None:
            label = point.label
        if point.label == label:
            yield point


class Budget:
    """The number of points that a request may still store unchanged, and the number of series that it may still add."""

    def __init__(self) -> None:
        self.points = MAX_POINTS
        self.series = MAX_SERIES


class Sampler:
    """Collects the points of one series from ``start`` to ``end`` (seconds), added in time order.

    Up to MAX_EXACT points are kept unchanged, if the budget allows. Beyond that, the time is divided into ``columns`` equal
    parts, and each part keeps only its lowest and its highest point.
    """

    def __init__(self, start: float, end: float, columns: int, budget: Budget | None = None) -> None:
        self.count = 0  # number of points added
        self.times = array("d")
        self.values = array("d")
        self._start = start
        self._width = max(end - start, 1e-9) / max(columns, 1)
        self._budget = budget or Budget()
        self._columns: dict[int, list[float]] | None = None  # column -> (low, its time, high, its time)

    @property
    def is_exact(self) -> bool:
        """Return whether all points are still stored unchanged."""
        return self._columns is None

    def add(self, time: float, value: float) -> None:
        """Add a point to the series."""
        self.count += 1
        if self._columns is not None:
            self._widen(time, value)
            return
        self.times.append(time)
        self.values.append(value)
        self._budget.points -= 1
        if len(self.times) > MAX_EXACT or self._budget.points < 0:
            self._columns = {}
            for at, each in zip(self.times, self.values, strict=True):
                self._widen(at, each)
            self._budget.points += len(self.times)
            self.times, self.values = array("d"), array("d")

    def _widen(self, time: float, value: float) -> None:
        assert self._columns is not None
        if not math.isfinite(value):
            return
        number = int((time - self._start) / self._width)
        column = self._columns.get(number)
        if column is None:
            self._columns[number] = [value, time, value, time]
        elif value < column[0]:
            column[:2] = value, time
        elif value > column[2]:
            column[2:] = value, time

    def result(self) -> tuple[list[float], list[float | None]]:
        """Return the times and the values. A value that is not finite is returned as None."""
        if self._columns is None:
            return list(self.times), [each if math.isfinite(each) else None for each in self.values]
        found = []
        for low, low_time, high, high_time in self._columns.values():
            found += [(low_time, low)] if low_time == high_time else [(low_time, low), (high_time, high)]
        found.sort()
        return [time for time, _ in found], [value for _, value in found]


def sample(
    found: Iterable[tuple[int, Point]],
    count: int,
    start: float,
    end: float,
    columns: int,
    budget: Budget | None = None,
) -> list[dict[str, Sampler]]:
    """For each of ``count`` paths, return a dict that maps labels to samplers. Leave out series that exceed the budget."""
    budget = budget or Budget()
    samplers: list[dict[str, Sampler]] = [{} for _ in range(count)]
    for number, (label, time, value) in found:
        own = samplers[number]
        sampler = own.get(label)
        if sampler is None:
            if len(own) == MAX_LABELS or not budget.series:
                continue
            budget.series -= 1
            sampler = own[label] = Sampler(start, end, columns, budget)
        sampler.add(time, value)
    return samplers
