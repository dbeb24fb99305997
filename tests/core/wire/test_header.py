"""core/wire/header: golden bytes in both directions, and refused headers."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import WireError
from minirospy.core.wire.header import MAX_HEADER, parse_header, serialize_header

# "callerid=/a" has 11 bytes, "topic=/t" has 8: each has a length prefix, and so has the whole header.
GOLDEN = b"\x1b\x00\x00\x00" + b"\x0b\x00\x00\x00callerid=/a" + b"\x08\x00\x00\x00topic=/t"


def test_fields_are_sent_sorted_with_their_lengths() -> None:
    assert serialize_header({"topic": "/t", "callerid": "/a"}) == GOLDEN


def test_golden_bytes_are_read() -> None:
    assert parse_header(GOLDEN[4:]) == {"callerid": "/a", "topic": "/t"}


@given(
    st.dictionaries(
        st.text(st.characters(exclude_characters="=", exclude_categories=["Cs"])),
        st.text(st.characters(exclude_categories=["Cs"])),
    )
)
def test_what_is_written_is_read(fields: dict[str, str]) -> None:
    assert parse_header(serialize_header(fields)[4:]) == fields


def test_a_value_may_hold_equal_signs_and_lines() -> None:
    fields = {"message_definition": "int8 A=1\n" + "=" * 80 + "\nMSG: a/B\n"}
    assert parse_header(serialize_header(fields)[4:]) == fields


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (b"\x05\x00\x00", "inside a field's length"),
        (b"\x05\x00\x00\x00a=b", "longer than the header"),
        (b"\x03\x00\x00\x00abc", "has no '='"),
    ],
)
def test_garbage_is_refused(body: bytes, why: str) -> None:
    with pytest.raises(WireError, match=why):
        parse_header(body)


@given(st.binary())
def test_any_bytes_are_read_or_refused(body: bytes) -> None:
    try:
        fields = parse_header(body)
    except WireError:
        return
    assert all(isinstance(value, str) for value in fields.values())


def test_bytes_that_are_not_utf_8_are_read() -> None:
    """Third-party clients send names and definitions in any encoding, so a comment must not break a connection."""
    body = b"\x07\x00\x00\x00na\xe9me=\xff"
    assert parse_header(body) == {"na\ufffdme": "\ufffd"}


def test_empty_field_at_the_end_is_read() -> None:
    assert parse_header(b"\x01\x00\x00\x00=") == {"": ""}
    with pytest.raises(WireError, match="has no '='"):
        parse_header(b"\0\0\0\0")


def test_limit_of_a_header_is_four_mebibytes() -> None:
    assert MAX_HEADER == 4194304
