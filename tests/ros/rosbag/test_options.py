"""The parsing of durations, sizes and topics by `rosbag record`."""

from __future__ import annotations

import pytest

from minirospy.base.errors import UsageError
from minirospy.ros.rosbag.recording.options import RecordOptions, parse_duration, parse_size, topic_filter

SECOND = 10**9


@pytest.mark.parametrize(
    ("text", "nanoseconds"),
    [
        ("30", 30 * SECOND),
        ("30s", 30 * SECOND),
        ("5m", 300 * SECOND),
        ("1.5h", 5400 * SECOND),
        (".5", SECOND // 2),
    ],
)
def test_durations(text: str, nanoseconds: int) -> None:
    assert parse_duration(text) == nanoseconds


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("5x", "Duration unit must be s, m, or h"),
        ("x", "Duration must start with a floating point number."),
        ("", "Duration must start with a floating point number."),
        ("-3s", "Duration must be positive."),
        ("0", "Duration must be positive."),
        ("1e400", "Duration must be positive."),
    ],
)
def test_bad_durations_are_refused_in_the_words_of_ros(text: str, why: str) -> None:
    with pytest.raises(UsageError) as caught:
        parse_duration(text)
    assert str(caught.value) == why


@pytest.mark.parametrize(
    ("text", "size"),
    [("1G", 2**30), ("2g", 2**31), ("500M", 500 * 2**20), ("20k", 20_480), ("1000", 1000), ("0", 0)],
)
def test_sizes(text: str, size: int) -> None:
    assert parse_size(text) == size


@pytest.mark.parametrize("text", ["lots", "5X", "1GB", "-1G", ""])
def test_size_needs_a_number_and_a_known_unit(text: str) -> None:
    with pytest.raises(UsageError, match=f"the size '{text}' must be"):
        parse_size(text)


def test_expressions_match_whole_names() -> None:
    matches = topic_filter(RecordOptions(topics=("/cam.*/image", "/tf"), regex=True))

    assert matches("/camera1/image")
    assert matches("/tf")
    assert not matches("/tf_static")
    assert not matches("/ns/tf")


def test_exclusion_wins() -> None:
    matches = topic_filter(RecordOptions(all_topics=True, exclude="/rosout.*"))
    of_node = topic_filter(RecordOptions(node="/n", exclude="/rosout.*"), subscribed_by_node=True)

    assert matches("/tf")
    assert not matches("/rosout_agg")
    assert of_node("/tf")
    assert not of_node("/rosout")


@pytest.mark.parametrize(
    "options", [RecordOptions(topics=("/(a",), regex=True), RecordOptions(all_topics=True, exclude="*")]
)
def test_a_wrong_expression_is_named(options: RecordOptions) -> None:
    with pytest.raises(UsageError, match="regular expression"):
        topic_filter(options)
