"""Paths of plots in messages: the table that the page's tests read, too."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from rospy import Time
from std_msgs.msg import UInt8MultiArray

from minirospy.base.errors import UsageError
from minirospy.introspect.field_series import parse_steps, select

TABLE = json.loads((Path(__file__).parents[1] / "web" / "page" / "paths.json").read_text(encoding="utf-8"))


def message(value: Any) -> Any:
    """Return an object with slots, as a message has, for a JSON value."""
    if isinstance(value, list):
        return [message(each) for each in value]
    if not isinstance(value, dict):
        return value
    if value.keys() == {"secs", "nsecs"}:
        return Time(value["secs"], value["nsecs"])
    made = type("Made", (), {"__slots__": list(value), "_type": "test/Made"})()
    for name, each in value.items():
        setattr(made, name, message(each))
    return made


@pytest.mark.parametrize("path", TABLE["series"])
def test_path_finds_the_same_numbers_as_on_the_page(path: str) -> None:
    found = dict(select(message(TABLE["message"]), parse_steps(path)))
    assert list(found) == list(TABLE["series"][path])
    assert found == pytest.approx(TABLE["series"][path], abs=1e-7)


@pytest.mark.parametrize("path", TABLE["refused"])
def test_wrong_syntax_is_refused(path: str) -> None:
    with pytest.raises(UsageError, match="is not a field"):
        parse_steps(path)


@pytest.mark.parametrize(
    ("path", "why"),
    [
        ("[" + "a" * 16_000, "at most 1,000 characters"),
        ("/a" * 51, "at most 50 steps"),
        ("/a[" + "9" * 10 + "]", "is not a field"),
        ("/a[:" + "9" * 10 + "]", "is not a field"),
    ],
)
def test_long_paths_are_refused(path: str, why: str) -> None:
    with pytest.raises(UsageError, match=why):
        parse_steps(path)
    assert len(parse_steps("/a" * 50)) == 50
    assert parse_steps("[" + "9" * 9 + "]") == [999_999_999]


def test_bytes_are_numbers_and_a_whole_array_has_at_most_fifty_series() -> None:
    array = UInt8MultiArray(data=bytes(range(200)))
    assert dict(select(array, parse_steps("/data[7]"))) == {"/data[7]": 7}
    assert len(dict(select(array, parse_steps("/data")))) == 50
    assert len(dict(select(array, parse_steps("/data[:]")))) == 50


def test_methods_and_private_names_are_no_fields() -> None:
    array = UInt8MultiArray(data=b"1")
    for path in ("/serialize", "/_type", "/__class__", "/data/__len__", "/layout/_slot_types"):
        assert dict(select(array, parse_steps(path))) == {}
