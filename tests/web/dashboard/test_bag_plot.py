"""Requests for series of bags: what a page may ask, and the one line for each that cannot be read."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Float64

from minirospy.base.errors import BagError, UsageError
from minirospy.core.bag.writer import BagWriter
from minirospy.introspect import bag_series
from minirospy.web.dashboard.bag_folder import BagFolder
from minirospy.web.dashboard.bag_plot import SeriesRequest, fields_of, series_of
from tests.web.dashboard.bags import SECOND, START, make_bag


def asked(*series: Any, **fields: Any) -> SeriesRequest:
    return SeriesRequest.parse(
        {"id": 1, "start": None, "end": None, "columns": 100, "series": list(series), **fields}
    )


def ask(folder: Path, *series: Any, **fields: Any) -> Any:
    """Return the answer to a request, as the page receives it."""
    answer = series_of(BagFolder(folder), asked(*series, **fields), lambda share: None)
    return json.loads(json.dumps(answer, allow_nan=False))


def test_topics_of_a_bag_have_their_definitions(tmp_path: Path) -> None:
    make_bag(tmp_path / "run.bag")
    found = fields_of(BagFolder(tmp_path), "run.bag")
    assert (found["name"], found["start"], found["length"]) == ("run.bag", START / 1e9, 19.9)
    topics = found["topics"]
    assert isinstance(topics, list)
    assert [each[0] for each in topics] == ["/camera", "/chatter", "/map"]
    assert topics[1][1] == "std_msgs/String"
    assert "string data" in topics[1][2]


def test_series_of_several_bags_and_their_errors_are_in_one_answer(tmp_path: Path) -> None:
    make_bag(tmp_path / "run.bag")
    make_bag(tmp_path / "other.bag", 5)
    answer = ask(
        tmp_path,
        {"key": "a", "bag": "run.bag", "path": "/camera/height"},
        {"key": "b", "bag": "other.bag", "path": "/camera/header/seq"},
        {"key": "c", "bag": "run.bag", "path": "/chatter/data"},
        {"key": "d", "bag": "run.bag", "path": "/camera/height["},
        {"key": "e", "bag": "gone.bag", "path": "/camera/height"},
        {
            "key": "f",
            "bag": "run.bag",
            "path": "/camera/height",
            "minus": {"bag": "other.bag", "path": "/camera/width"},
        },
    )
    series = {each["key"]: each for each in answer["found"]}
    assert answer["id"] == 1
    assert series.keys() == {"a", "b", "f"}
    assert (series["a"]["count"], series["a"]["times"][:3], set(series["a"]["values"])) == (
        40,
        [0, 0.5, 1],
        {30},
    )
    assert series["b"]["length"] == pytest.approx(4.9)
    # Outside of the shorter bag there is no difference.
    assert (series["f"]["times"][-1], set(series["f"]["values"])) == (4.5, {-10})
    assert answer["errors"].keys() == {"c", "d", "e"}
    assert answer["errors"]["c"] == "no number at /chatter in the messages of this bag"
    assert all("\n" not in each for each in answer["errors"].values())


def test_range_of_a_difference_has_points_up_to_its_ends(tmp_path: Path) -> None:
    make_bag(tmp_path / "run.bag")
    operand = {"bag": "run.bag", "path": "/camera/height"}
    answer = ask(tmp_path, {"key": "a", **operand, "minus": operand}, start=3, end=5)
    assert answer["found"][0]["times"] == [3, 3.5, 4, 4.5, 5]


def write_numbers(path: Path, topics: dict[str, list[tuple[float, float]]]) -> None:
    """Write a bag with numbers by topic, each with its second."""
    with path.open("wb") as stream:
        writer = BagWriter(stream)
        for topic, rows in topics.items():
            kind = Float64
            number = writer.add_connection(
                topic, {"type": kind._type, "md5sum": kind._md5sum, "message_definition": kind._full_text}
            )
            for second, value in rows:
                writer.write(number, START + round(second * SECOND), struct.pack("<d", value))
        writer.close()


def test_range_of_a_difference_uses_points_far_outside_of_it(tmp_path: Path) -> None:
    write_numbers(
        tmp_path / "slow.bag",
        {
            "/a": [(second / 2, 5) for second in range(1_200)],
            "/b": [(0, 0), (30, 1), (230, 2), (430, 2), (599, 2)],
        },
    )
    asked_for = {
        "key": "k",
        "bag": "slow.bag",
        "path": "/a/data",
        "minus": {"bag": "slow.bag", "path": "/b/data"},
    }
    for start, end in ((1, 2), (14, 16), (105, 125), (225, 235), (420, 425), (598, 700)):
        [found] = ask(tmp_path, asked_for, start=start, end=end)["found"]
        assert (found["times"][0], found["times"][-1]) == (start, min(end, 599)), (start, end)
        assert found["count"] == 2 * (min(end, 599) - start) + 1
    [found] = ask(tmp_path, asked_for, start=130, end=130)["found"]
    assert found["values"] == [3.5]


@pytest.mark.parametrize("path", ["/camera/height[" + "9" * 5_000 + "]", "/camera" + "/a" * 1_000])
def test_extreme_path_fails_alone(tmp_path: Path, path: str) -> None:
    make_bag(tmp_path / "run.bag")
    good = {"key": "a", "bag": "run.bag", "path": "/camera/height"}
    answer = ask(tmp_path, good, {"key": "b", "bag": "run.bag", "path": path})
    assert [each["key"] for each in answer["found"]] == ["a"]
    assert answer["errors"].keys() == {"b"}


@pytest.mark.parametrize(
    "fields",
    [
        {"columns": "x"},
        {"series": "x"},
        {"series": [1]},
        {"series": [{"key": "a", "bag": "b"}]},
        {"series": [{"key": "a", "bag": "b", "path": "/c", "minus": 3}]},
        {"start": "x"},
    ],
)
def test_wrong_requests_are_refused(fields: Any) -> None:
    with pytest.raises((TypeError, LookupError)):
        asked(**fields) if "series" not in fields else SeriesRequest.parse({"columns": 1, **fields})


def test_number_of_paths_is_limited() -> None:
    with pytest.raises(UsageError, match="at most"):
        asked(*[{"key": "a", "bag": "b", "path": "/c"}] * 101)


def test_path_above_the_number_of_series_has_a_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_bag(tmp_path / "run.bag")
    make_bag(tmp_path / "other.bag")
    monkeypatch.setattr(bag_series, "MAX_SERIES", 1)
    bags = ("run.bag", "other.bag")
    answer = ask(tmp_path, *({"key": bag, "bag": bag, "path": "/camera/height"} for bag in bags))
    assert [each["key"] for each in answer["found"]] == ["run.bag"]
    assert answer["errors"] == {"other.bag": "a plot has at most 1 series of bags"}


def test_reading_ends_if_the_page_leaves(tmp_path: Path) -> None:
    make_bag(tmp_path / "run.bag")

    def left(share: float) -> None:
        raise BagError("the page has left")

    request = asked({"key": "a", "bag": "run.bag", "path": "/camera/height"})
    with pytest.raises(BagError, match="left"):
        series_of(BagFolder(tmp_path), request, left)
