"""Topic statistics: counts of the messages received from each publisher of a topic, published on /statistics.

Enabled if the parameter /enable_statistics is set when a topic is subscribed to.
Source: http://wiki.ros.org/Topics#Topic_statistics, http://wiki.ros.org/rospy/Overview/Topics%20statistics.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from minirospy.client.session import current_session
from minirospy.client.time import Duration, Time
from minirospy.core.idl.protocols import Message, is_stamped
from minirospy.core.wire.header import Header

if TYPE_CHECKING:
    from rosgraph_msgs.msg import TopicStatistics

    from minirospy.client.publisher import Publisher
    from minirospy.core.idl.protocols import Message

__all__ = ["Report", "Spread", "StatisticsPublisher", "TopicStatisticsCounter", "WindowLimits"]

_FIRST_WINDOW = 2.0


class WindowLimits(NamedTuple):
    """The limits within which the length of a statistics window is adapted.

    The window's length doubles, up to ``max_size`` seconds, if it has fewer than ``min_elements`` messages. The length halves,
    down to ``min_size``, if it has more than ``max_elements``.
    """

    min_elements: float = 10
    max_elements: float = 100
    min_size: float = 4.0
    max_size: float = 64.0

    @classmethod
    def read(cls, get: Callable[[str, object], float]) -> WindowLimits:
        """Return the limits set by the parameters /statistics_window_...; ``get(key, default)`` reads one parameter."""
        return cls(
            *(get(f"/statistics_window_{name}", default) for name, default in cls._field_defaults.items())
        )


class Spread(NamedTuple):
    """The mean, standard deviation and maximum of some durations, in seconds."""

    mean: float = 0.0
    stddev: float = 0.0
    max: float = 0.0

    @classmethod
    def of(cls, values: list[float]) -> Spread:
        """Return the mean, standard deviation and maximum of ``values``, or zeros if there are no values."""
        if not values:
            return cls()
        mean = math.fsum(values) / len(values)
        return cls(mean, math.sqrt(math.fsum((v - mean) ** 2 for v in values) / len(values)), max(values))


class Report(NamedTuple):
    """One window's measurements for one publisher.

    Times are in nanoseconds, ``Spread`` values in seconds, ``traffic`` in bytes.
    """

    publisher: str
    start: int
    stop: int
    delivered: int
    dropped: int
    traffic: int
    period: Spread
    stamp_age: Spread


@dataclass
class _Window:
    start: int
    seconds: float = _FIRST_WINDOW
    delivered: int = 0
    dropped: int = 0
    traffic: int = 0
    last_arrival: int = 0
    last_sequence: int | None = None
    periods: list[float] = field(default_factory=list)
    ages: list[float] = field(default_factory=list)


class TopicStatisticsCounter:
    """Counts the messages on one topic and returns a report whenever a publisher's window is over.

    Each connection's thread counts its own messages; each publisher has only one connection.
    """

    def __init__(self, limits: WindowLimits) -> None:
        self._limits = limits
        self._windows: dict[str, _Window] = {}

    def count(self, message: Message, header: Header, size: int, now: int) -> Report | None:
        """Count a message of ``size`` bytes that arrived at ``now`` (ns). If it ends a window, return the report."""
        publisher = header.get("callerid", "")
        window = self._windows.get(publisher)
        if window is None or now < window.start:
            # Start a window: this is the first message, or simulated time has jumped back.
            window = self._windows[publisher] = _Window(now)

        window.delivered += 1
        window.traffic += size + 4
        if window.last_arrival:
            window.periods.append((now - window.last_arrival) / 1e9)
        window.last_arrival = now

        if is_stamped(message):
            sequence, stamp = message.header.seq, message.header.stamp.to_nsec()
            if window.last_sequence is not None:
                window.dropped += max(0, sequence - window.last_sequence - 1)
            window.last_sequence = sequence
            # Ignore a stamp of zero, which the publisher has not set.
            if stamp:
                window.ages.append((now - stamp) / 1e9)

        if now - window.start < window.seconds * 1e9:
            return None
        return self._end(publisher, window, now)

    def _end(self, publisher: str, window: _Window, now: int) -> Report:
        report = Report(
            publisher,
            window.start,
            now,
            window.delivered,
            window.dropped,
            window.traffic,
            Spread.of(window.periods),
            Spread.of(window.ages),
        )

        limits, seconds = self._limits, window.seconds
        if window.delivered > limits.max_elements and seconds / 2 >= limits.min_size:
            seconds /= 2
        elif window.delivered < limits.min_elements and seconds * 2 <= limits.max_size:
            seconds *= 2

        self._windows[publisher] = _Window(
            now, seconds, last_arrival=window.last_arrival, last_sequence=window.last_sequence
        )
        return report


class StatisticsPublisher:
    """Counts the messages on one of this node's topics and publishes the reports on /statistics."""

    def __init__(self, topic: str) -> None:
        from rosgraph_msgs.msg import TopicStatistics

        from minirospy.client.params import get_param
        from minirospy.client.publisher import Publisher

        self._topic = topic
        self._message_class: type[TopicStatistics] = TopicStatistics
        self._counter = TopicStatisticsCounter(WindowLimits.read(get_param))
        self._publisher: Publisher[TopicStatistics] = Publisher("/statistics", TopicStatistics, queue_size=10)

    def count(self, message: Message, header: Header, size: int) -> None:
        """Count one message of ``size`` bytes."""
        report = self._counter.count(message, header, size, current_session().clock.now())
        if report:
            self._publisher.publish(self._as_message(report))

    def _as_message(self, report: Report) -> TopicStatistics:
        message = self._message_class()
        message.topic = self._topic
        message.node_pub = report.publisher
        message.node_sub = current_session().name
        message.window_start = Time(nsecs=report.start)
        message.window_stop = Time(nsecs=report.stop)
        message.delivered_msgs = report.delivered
        message.dropped_msgs = report.dropped
        message.traffic = report.traffic
        for name, spread in (("period", report.period), ("stamp_age", report.stamp_age)):
            for part, seconds in spread._asdict().items():
                setattr(message, f"{name}_{part}", Duration.from_sec(seconds))
        return message
