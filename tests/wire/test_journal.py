"""wire/journal: what is written is read again; of a damaged file, everything up to the damage."""

from __future__ import annotations

import datetime
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.wire.journal import HEAD, parse_journal, serialize_record
from minirospy.wire.xmlrpc import DateTime

SCALARS = (
    st.integers(-(2**31), 2**31 - 1)
    | st.booleans()
    | st.text(st.characters(exclude_categories=["Cs"]))
    | st.floats(allow_nan=False)
    | st.binary(max_size=20)
    | st.datetimes()
    | st.text(max_size=5).map(DateTime)
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=8,
)
RECORDS = st.lists(st.lists(VALUES, min_size=1, max_size=4), max_size=5)


def written(records: list[list[Any]]) -> bytes:
    return HEAD + b"".join(map(serialize_record, records))


@given(RECORDS)
def test_records_come_back(records: list[list[Any]]) -> None:
    data = written(records)
    assert parse_journal(data) == (records, len(data), "")


@given(RECORDS, st.data())
def test_a_torn_file_is_read_up_to_its_last_whole_record(
    records: list[list[Any]], data: st.DataObject
) -> None:
    whole = written(records)
    cut = data.draw(st.integers(0, len(whole)))
    found = parse_journal(whole[:cut])
    assert found.records == records[: len(found.records)]
    assert found.size <= cut
    if found.size == cut:
        assert found.damage == ("" if cut else "it is empty")
    else:
        assert found.damage


@given(RECORDS.filter(bool), st.data())
def test_a_changed_byte_ends_the_file_there(records: list[list[Any]], data: st.DataObject) -> None:
    whole = bytearray(written(records))
    at = data.draw(st.integers(0, len(whole) - 1))
    whole[at] ^= data.draw(st.integers(1, 255))
    found = parse_journal(bytes(whole))
    assert found.damage
    assert found.records == records[: len(found.records)]
    assert found.size <= at


@given(st.binary(max_size=200), st.booleans())
def test_any_bytes_are_read(data: bytes, headed: bool) -> None:
    parse_journal(HEAD + data if headed else data)


def test_dates_and_bytes() -> None:
    record = ["set", "/d", {"a": datetime.datetime(2020, 1, 2), "b": b"\0\xff", "c": DateTime("some day")}]
    assert parse_journal(written([record])).records == [record]


@pytest.mark.parametrize("value", [object(), {1, 2}, 2**70])
def test_what_no_journal_holds(value: object) -> None:
    with pytest.raises((TypeError, ValueError)):
        serialize_record(["set", "/a", value])
