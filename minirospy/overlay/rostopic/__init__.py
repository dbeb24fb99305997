"""rostopic, filled in by minirospy: what user code asks of topics. Source: http://wiki.ros.org/rostopic."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from minirospy.errors import MasterUnreachableError, MinirospyError, UsageError
from minirospy.introspect import topics
from minirospy.introspect.fields import field_value, parse_path
from minirospy.introspect.graph import Graph
from minirospy.introspect.rates import BandwidthWindow, DelayWindow, RateWindow

__all__ = [
    "NAME", "ROSTopicBandwidth", "ROSTopicDelay", "ROSTopicException", "ROSTopicHz", "ROSTopicIOException",
    "find_by_type", "get_topic_class", "get_topic_list", "get_topic_type", "msgevalgen", "rostopicmain",
]  # fmt: skip

NAME = "rostopic"


class ROSTopicException(Exception):
    """A topic cannot be used as asked."""


class ROSTopicIOException(ROSTopicException):
    """The master does not answer."""


class _NoMaster(ROSTopicIOException, ConnectionRefusedError):
    """As programs expect it of some of ROS's functions, also an error of sockets."""


def get_topic_type(
    topic: str, blocking: bool = False
) -> tuple[str | None, str | None, Callable[[Any], Any] | None]:
    """(type, topic, function that takes the field out of a message); three times None where it is not there.

    ``topic`` may be a field of a topic's messages. ``blocking`` waits until it is there.
    """
    with _graph() as graph:
        field = topics.find_topic(graph, graph.resolve(topic))
        while field is None and blocking:
            time.sleep(0.1)
            field = topics.find_topic(graph, graph.resolve(topic))
    if field is None:
        return None, None, None
    return field.type, field.topic, msgevalgen(field.path)


def get_topic_class(
    topic: str, blocking: bool = False
) -> tuple[type[Any] | None, str | None, Callable[[Any], Any] | None]:
    """Like :func:`get_topic_type`, with the message's class. Raises ROSTopicException where it is not installed."""
    from minirospy.idl.load import get_message_class

    type_, real_topic, function = get_topic_type(topic, blocking)
    if type_ is None:
        return None, None, None
    cls: type[Any] | None = get_message_class(type_)
    if cls is None:
        raise ROSTopicException(f"Cannot load message class for [{type_}]. Are your messages built?")
    return cls, real_topic, function


def get_topic_list(master: Any = None) -> tuple[list[Any], list[Any]]:
    """(published, subscribed), each a list of (topic, type, nodes)."""
    with _graph() as graph:
        found = topics.list_topics(graph)
    published, subscribed = ([(each.name, each.type, list(each.nodes)) for each in side] for side in found)
    return published, subscribed


def find_by_type(topic_type: str) -> list[str]:
    """The topics of a type."""
    with _graph() as graph:
        return topics.find_topics_of_type(graph, topic_type)


def msgevalgen(pattern: str) -> Callable[[Any], Any] | None:
    """A function that takes the field at a path (``/pose/x``) out of a message; None for the message itself.

    None, too, where the path does not parse, which is then said on stderr.
    """
    try:
        steps = parse_path(pattern.strip("/"))
    except UsageError as error:
        print(f"rostopic: {error}", file=sys.stderr)
        return None
    return (lambda message: field_value(message, steps)) if steps else None


class ROSTopicHz:
    """Measures the rate of topics: ``rospy.Subscriber(topic, rospy.AnyMsg, hz.callback_hz, callback_args=topic)``."""

    def __init__(
        self,
        window_size: int,
        filter_expr: Callable[[Any], bool] | None = None,
        use_wtime: bool = False,
    ) -> None:
        self._size = max(window_size, 0)
        self._filter = filter_expr
        self._windows: dict[str | None, RateWindow] = {}
        self._lock = threading.Lock()

    def callback_hz(self, m: Any, topic: str | None = None) -> None:
        """A message has come."""
        if self._filter is None or self._filter(m):
            with self._lock:
                self._windows.setdefault(topic, RateWindow(self._size)).add(time.time())

    def get_hz(self, topic: str | None = None) -> tuple[float, float, float, float, int] | None:
        """(rate, least pause, longest pause, standard deviation, messages); None where nothing new has come."""
        with self._lock:
            report = self._windows.setdefault(topic, RateWindow(self._size)).report()
        return (
            None if report is None else (report.rate, report.min, report.max, report.std_dev, report.window)
        )

    def print_hz(self, topics: tuple[str | None, ...] = (None,)) -> None:
        """Print the rates."""
        for topic in topics:
            found = self.get_hz(topic)
            if found is None:
                print("no new messages")
                continue
            rate, low, high, std_dev, window = found
            print(f"average rate: {rate:.3f}")
            print(f"\tmin: {low:.3f}s max: {high:.3f}s std dev: {std_dev:.5f}s window: {window}")


class ROSTopicBandwidth:
    """Measures the bandwidth of a topic: ``rospy.Subscriber(topic, rospy.AnyMsg, bw.callback)``."""

    def __init__(self, window_size: int = 100) -> None:
        self._window = BandwidthWindow(window_size)
        self._lock = threading.Lock()

    def callback(self, data: Any) -> None:
        """A message has come."""
        with self._lock:
            self._window.add(time.time(), len(data._buff or b""))

    def print_bw(self) -> None:
        """Print the bandwidth, where two messages have come."""
        with self._lock:
            report = self._window.report(time.time())
        if report is None:
            return
        rate, mean, low, high = (_bytes(each) for each in (report.rate, report.mean, report.min, report.max))
        print(f"average: {rate}/s\n\tmean: {mean} min: {low} max: {high} window: {report.window}")


class ROSTopicDelay:
    """Measures how late a topic's stamped messages come: ``rospy.Subscriber(topic, Type, delay.callback_delay)``."""

    def __init__(self, window_size: int) -> None:
        self._window = DelayWindow(max(window_size, 0))
        self._lock = threading.Lock()

    def callback_delay(self, msg: Any) -> None:
        """A message has come. Raises ROSTopicException where it has no header."""
        if not msg._has_header:
            raise ROSTopicException("msg does not have header")
        from minirospy.client import get_time

        with self._lock:
            self._window.add(get_time(), msg.header.stamp.to_sec())

    def get_delay(self) -> tuple[float, float, float, float, int] | None:
        """(mean, least, longest, standard deviation, messages); None where nothing new has come."""
        with self._lock:
            report = self._window.report()
        return (
            None if report is None else (report.mean, report.min, report.max, report.std_dev, report.window)
        )

    def print_delay(self) -> None:
        """Print the delay, where something new has come."""
        found = self.get_delay()
        if found is None:
            return
        mean, low, high, std_dev, window = found
        print(f"average delay: {mean:.3f}")
        print(f"\tmin: {low:.3f}s max: {high:.3f}s std dev: {std_dev:.5f}s window: {window}")


def rostopicmain(argv: Sequence[str] | None = None) -> int:
    """The command; ``argv`` begins with its name. Its exit status."""
    from minirospy.cli.rostopic import main

    return main(list(sys.argv if argv is None else argv)[1:])


def _bytes(size: float) -> str:
    """A number of bytes as `rostopic bw` prints it."""
    if size < 1000:
        return f"{size:.2f}B"
    return f"{size / 1000:.2f}KB" if size < 1000000 else f"{size / 1000000:.2f}MB"


@contextmanager
def _graph() -> Iterator[Graph]:
    try:
        with Graph.open("rostopic") as graph:
            yield graph
    except MasterUnreachableError as error:
        raise _NoMaster(str(error)) from error
    except MinirospyError as error:
        raise ROSTopicException(str(error)) from error
