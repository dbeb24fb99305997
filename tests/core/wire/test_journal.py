"""core/wire/journal: written records are read back; a damaged file is read up to the damage."""

from __future__ import annotations

import datetime
import struct
import zlib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.core.wire.journal import (
    HEAD,
    STEP_BYTES,
    STEP_ITEMS,
    pack_in_steps,
    parse_journal,
    serialize_record,
    unpack,
)
from minirospy.core.wire.xmlrpc import DateTime

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


def framed(body: bytes) -> bytes:
    """Return a record with this body, which may be invalid."""
    return struct.pack("<II", len(body), zlib.crc32(body)) + body


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


def test_bytes_of_a_record() -> None:
    """A file written by an earlier version must still be readable."""
    record = ["set", "/d", [datetime.datetime(2020, 1, 2), DateTime("some day")]]
    body = b"\x93\xa3set\xa2/d\x92\xc7\x13\x012020-01-02T00:00:00\xd7\x02some day"
    assert serialize_record(record) == framed(body)


@pytest.mark.parametrize("value", [object(), {1, 2}, 2**70])
def test_invalid_journal_records_are_refused(value: object) -> None:
    with pytest.raises((TypeError, ValueError)):
        serialize_record(["set", "/a", value])


@pytest.mark.parametrize(
    ("data", "damage"),
    [
        (b"", "it is empty"),
        (b"minirospy", "it does not start as a journal"),
        (HEAD + b"\1", "its last record is torn"),
        (HEAD + serialize_record([1])[:7], "its last record is torn"),
        (HEAD + serialize_record([1])[:-1], "its last record is torn"),
        (HEAD + b"\1\0\0\0\0\0\0\0\x90", "the record at byte 20 is damaged"),
        (HEAD + serialize_record([1]) + serialize_record([]), "the record at byte 30 is damaged"),
        (HEAD + framed(b"\1"), "the record at byte 20 is damaged"),
        (HEAD + framed(b"\xc1"), "the record at byte 20 is damaged"),
        (HEAD + framed(b"\x91\xc7\1\5x"), "the record at byte 20 is damaged"),
        (HEAD + framed(b"\x91"), "the record at byte 20 is damaged"),
        (HEAD + framed(b""), "the record at byte 20 is damaged"),
        (HEAD + serialize_record([1]) + framed(b"x" * 99)[:-1], "its last record is torn"),
    ],
)
def test_damage_is_named(data: bytes, damage: str) -> None:
    assert parse_journal(data).damage == damage


def test_dictionary_may_have_any_keys() -> None:
    """A master that does not start because of another version's record would be worse than one that passes the record on."""
    assert parse_journal(HEAD + framed(b"\x91\x81\1\2")).records == [[{1: 2}]]


# --- large values in pieces

LARGE = st.sampled_from([[1] * 5000, "x" * 300_000, "\u0151" * 150_000, b"y" * 300_000, {"k" * 200_000: 1}])


@given(
    st.recursive(
        SCALARS | LARGE,
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
        max_leaves=5,
    )
)
def test_pieces_are_the_whole_value(value: Any) -> None:
    assert unpack(b"".join(pack_in_steps(value))) == value


@pytest.mark.parametrize("count", [0, 1, 3 * STEP_ITEMS, 3 * STEP_ITEMS + 1])
def test_list_of_numbers_comes_in_pieces_of_so_many(count: int) -> None:
    pieces = list(pack_in_steps([7] * count))
    # A header of up to five bytes, and a byte for each number.
    assert len(pieces) == count // STEP_ITEMS + 1
    assert max(map(len, pieces)) <= STEP_ITEMS + 5
    assert unpack(b"".join(pieces)) == [7] * count


@pytest.mark.parametrize("kind", [str, bytes])
def test_long_text_comes_in_pieces(kind: type) -> None:
    value = "z" * (3 * STEP_BYTES + 5)
    value = value if kind is str else value.encode()
    pieces = list(pack_in_steps([1, value, 2]))
    assert max(map(len, pieces)) == STEP_BYTES
    assert sum(len(each) == STEP_BYTES for each in pieces) == 3
    assert unpack(b"".join(pieces)) == [1, value, 2]
    # The longest value that fits into one piece.
    short = value[:STEP_BYTES]
    assert len(list(pack_in_steps(short))) == 1


def test_long_text_of_any_characters_comes_in_pieces() -> None:
    value = "\u0151" * (3 * STEP_BYTES + 5)
    pieces = list(pack_in_steps([1, value, 2]))
    # The first pieces are empty: a length is known only after encoding.
    assert [len(each) for each in pieces[:6]] == [2, 0, 0, 0, 0, 5]
    assert max(map(len, pieces)) == 2 * STEP_BYTES
    assert unpack(b"".join(pieces)) == [1, value, 2]


def test_many_texts_come_in_pieces() -> None:
    pieces = list(pack_in_steps(["x" * (STEP_BYTES // 2)] * 10))
    assert [len(each) // STEP_BYTES for each in pieces] == [1] * 5 + [0]


def test_pieces_hold_dates_and_refuse_what_no_journal_holds() -> None:
    value = [datetime.datetime(2026, 1, 2, 3, 4, 5), DateTime("x")]
    assert unpack(b"".join(pack_in_steps(value))) == value
    for wrong in (object(), (1, 2)):
        with pytest.raises(TypeError, match="a journal holds no"):
            list(pack_in_steps([wrong]))


@pytest.mark.parametrize("data", [b"", b"\xc1", b"\x91", b"\x91\xc7\1\5x", b"\1\1"])
def test_invalid_packed_data_is_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"."):
        unpack(data)
