"""Series of a bag for plots: points, differences, extremes of many points, damaged and odd bags."""

from __future__ import annotations

import math
from io import BytesIO
from typing import Any

import pytest
from geometry_msgs.msg import Vector3
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from minirospy.base.errors import BagFormatError, NotFoundError, UsageError
from minirospy.core.bag.base import BagReader
from minirospy.core.bag.reader import open_bag
from minirospy.core.bag.writer import BagWriter
from minirospy.introspect import bag_series
from minirospy.introspect.bag_series import Budget, Point, Sampler

SECOND = 10**9
START = 1_700_000_000 * SECOND


def body(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def bag(*rows: tuple[str, float, Any], chunk_size: int = 768 * 1024) -> BagReader:
    """Return a reader for a bag with (topic, seconds since START, message)."""
    stream = BytesIO()
    writer = BagWriter(stream, chunk_threshold=chunk_size)
    numbers: dict[str, int] = {}
    for topic, time, message in rows:
        if topic not in numbers:
            numbers[topic] = writer.add_connection(
                topic,
                {
                    "type": message._type,
                    "md5sum": message._md5sum,
                    "message_definition": message._full_text,
                },
            )
        data = message if isinstance(message, bytes) else body(message)
        writer.write(numbers[topic], START + round(time * SECOND), data)
    writer.close()
    stream.seek(0)
    return open_bag(stream)


def read(
    reader: BagReader, *paths: str, start: float | None = None, end: float | None = None
) -> list[tuple[int, Point]]:
    topics = [each.name for each in bag_series.bag_topics(reader)]
    return list(
        bag_series.points(reader, [bag_series.field_path(each, topics) for each in paths], start, end)
    )


def test_points_of_several_paths_come_in_one_pass_in_time_order() -> None:
    reader = bag(
        ("/a", 0.0, Vector3(1, 2, 3)),
        ("/joints", 0.5, JointState(name=["elbow"], position=[7.0])),
        ("/a", 1.0, Vector3(4, 5, 6)),
    )
    found = read(reader, "/a/y", "/joints/position[elbow]", "/a")
    assert found[0] == (0, Point("/a/y", 0.0, 2.0))
    assert [each for each in found if each[0] == 1] == [(1, Point("/joints/position[elbow]", 0.5, 7.0))]
    assert [point.label for number, point in found if number == 2] == ["/a/x", "/a/y", "/a/z"] * 2
    assert [point.time for _, point in found] == sorted(point.time for _, point in found)


def test_range_is_inclusive_in_seconds_since_the_start() -> None:
    reader = bag(*(("/a", float(at), Float64(at)) for at in range(6)))
    assert [point.value for _, point in read(reader, "/a/data", start=2, end=4)] == [2, 3, 4]
    assert [point.value for _, point in read(reader, "/a/data", start=-1, end=0)] == [0]
    assert read(reader, "/a/data", start=-3, end=-1) == []


def test_longest_topic_of_a_path_is_chosen() -> None:
    assert bag_series.field_path("/a/b/x", ["/a", "/a/b"]).topic == "/a/b"
    assert bag_series.field_path("/a/bc/x", ["/a", "/a/b"]).topic == "/a"
    with pytest.raises(NotFoundError, match="/a"):
        bag_series.field_path("/c/x", ["/a"])
    with pytest.raises(UsageError, match="is not a field"):
        bag_series.field_path("/a/x[", ["/a"])


def test_message_that_does_not_match_its_definition_is_an_error() -> None:
    reader = bag(("/a", 0.0, Float64(1)), ("/a", 1.0, b"short"))
    with pytest.raises(BagFormatError, match="/a does not match its definition"):
        read(reader, "/a/data")


def series(label: str, *points: tuple[float, float]) -> list[Point]:
    return [Point(label, time, value) for time, value in points]


def test_difference_is_interpolated_at_the_times_of_the_first() -> None:
    first = series("/a", (0, 1), (1, 2), (1.5, 3), (2, 4), (9, 5))
    second = series("/b", (1, 10), (2, 20), (3, 30))
    assert list(bag_series.differences(first, second)) == series("/a - /b", (1, -8), (1.5, -12), (2, -16))
    assert list(bag_series.differences(first, [])) == []
    assert list(bag_series.differences([], second)) == []
    # One point, and two of one time.
    assert list(bag_series.differences(first, series("/b", (1, 10)))) == series("/a - /b", (1, -8))
    both = list(bag_series.differences(series("/a", (1, 0)), series("/b", (1, 10), (1, 30))))
    assert both == series("/a - /b", (1, -10))


@pytest.mark.parametrize("neighbour", [math.nan, math.inf, 1e300])
def test_difference_uses_a_point_of_the_same_time_as_it_is(neighbour: float) -> None:
    second = series("/b", (0, neighbour), (1, 3))
    assert list(bag_series.differences(series("/a", (1, 5)), second)) == series("/a - /b", (1, 2))


def test_difference_uses_the_first_of_several_series() -> None:
    many = [Point("/a/x", 0, 5), Point("/a/y", 0, 50), Point("/a/x", 1, 6), Point("/a/y", 1, 60)]
    assert [each.value for each in bag_series.differences(many, many)] == [0, 0]


def test_few_points_are_kept_and_those_without_a_value_are_gaps() -> None:
    sampler = Sampler(0, 10, 5)
    for time, value in ((0, 1.0), (1, math.nan), (2, math.inf)):
        sampler.add(time, value)
    assert sampler.is_exact
    assert sampler.result() == ([0, 1, 2], [1.0, None, None])


def test_of_many_points_each_column_keeps_its_extremes() -> None:
    count = 5 * bag_series.MAX_EXACT
    sampler = Sampler(0, count, 100)
    for at in range(count):
        sampler.add(at, 1000.0 if at == 54_321 else math.nan if at % 7 == 0 else math.sin(at))
    times, values = sampler.result()
    assert not sampler.is_exact
    assert sampler.count == count
    assert len(times) <= 202
    assert times == sorted(times)
    assert (times[values.index(1000.0)], max(filter(None, values))) == (54_321, 1000.0)
    assert min(filter(None, values)) < -0.99


def test_one_path_has_a_limited_number_of_series() -> None:
    found = [(0, Point(f"/a[{label}]", 0.0, 1.0)) for label in range(500)]
    assert len(bag_series.sample(found, 1, 0, 1, 10)[0]) == bag_series.MAX_LABELS


def test_reading_is_ended_by_its_observer_after_a_chunk() -> None:
    reader = bag(*(("/a", float(at), Float64(at)) for at in range(5000)), chunk_size=4096)
    seen: list[float] = []

    def observe(time: float) -> None:
        seen.append(time)
        if len(seen) == 3:
            raise KeyboardInterrupt

    path = bag_series.field_path("/a/data", ["/a"])
    with pytest.raises(KeyboardInterrupt):
        list(bag_series.points(reader, [path], on_time=observe))
    assert 0 < seen[2] < 1000


def test_bag_without_messages_has_no_points() -> None:
    reader = bag()
    assert bag_series.bag_span(reader) == (0, 0)
    assert bag_series.bag_topics(reader) == []


def test_series_share_the_exact_points_of_a_request(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bag_series, "MAX_POINTS", 100)
    found = [(0, Point(f"/a/{at % 5}", at / 5, float(at))) for at in range(1_000)]
    [own] = bag_series.sample(found, 1, 0, 200, 10)
    kept = [len(each.result()[0]) for each in own.values()]
    assert sum(len(each.times) for each in own.values()) <= 100
    assert [each.count for each in own.values()] == [200] * 5
    assert min(kept) >= 20  # two of each column
    assert sum(kept) <= 100 + 5 * 20


def test_request_has_a_limited_number_of_series(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bag_series, "MAX_SERIES", 70)
    budget = Budget()
    found = [(at % 2, Point(f"/a/{at}", 0, 0)) for at in range(1_000)]
    assert sum(map(len, bag_series.sample(found, 2, 0, 1, 10, budget))) == 70
    assert bag_series.sample(found, 2, 0, 1, 10, budget) == [{}, {}]
