"""Parsing definitions: their parsed contents, and each error with its line."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import DefinitionError
from minirospy.core.idl.parse import parse_action, parse_message, parse_service
from minirospy.core.idl.spec import Constant, Field, FieldType


def fields(text: str) -> list[tuple[str, str]]:
    return [(str(field.type), field.name) for field in parse_message(text, "p", "M").fields]


def constants(text: str) -> list[tuple[str, object, str]]:
    return [(c.name, c.value, c.text) for c in parse_message(text, "p", "M").constants]


def test_fields() -> None:
    text = "# comment\n\nint8 a # more\n  string[] b\nHeader h\nOther[3] o\nother_msgs/Thing  t\ntime[] when"
    assert fields(text) == [
        ("int8", "a"), ("string[]", "b"), ("std_msgs/Header", "h"), ("p/Other[3]", "o"), ("other_msgs/Thing", "t"),
        ("time[]", "when"),
    ]  # fmt: skip


def test_constants() -> None:
    text = 'int32 A=-1\nuint8 B = 0x0F # hex\nfloat32 F=1e-3\nbool T=True\nbool N=0\nstring S= "a" # b \nchar C=65'
    assert constants(text) == [
        ("A", -1, "-1"), ("B", 15, "0x0F"), ("F", 0.001, "1e-3"), ("T", True, "True"), ("N", False, "0"),
        ("S", '"a" # b', '"a" # b'), ("C", 65, "65"),
    ]  # fmt: skip


def test_the_parts_of_a_spec() -> None:
    spec = parse_message("Header header\nint8 X=1\n", "p", "M")
    assert spec.full_name == "p/M"
    assert spec.has_header
    assert spec.fields == (Field("header", FieldType("std_msgs/Header")),)
    assert spec.constants == (Constant("X", "int8", 1, "1"),)
    assert not parse_message("int8 x\nHeader header\n", "p", "M").has_header


def test_services_and_actions() -> None:
    service = parse_service("int8 a\n---\nint8 b\n", "p", "S")
    assert (service.request.full_name, service.response.full_name) == ("p/SRequest", "p/SResponse")
    action = parse_action("int8 goal\n---\nint8 result\n---\nint8 feedback\n", "p", "A")
    assert [message.name for message in action.messages] == [
        "AGoal", "AResult", "AFeedback", "AActionGoal", "AActionResult", "AActionFeedback", "AAction",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "line", "error"),
    [
        ("int8", 1, "neither 'type name' nor 'type NAME=value'"),
        ("int8 x\n\nint8 x", 3, "[x] is declared twice"),
        ("int8 1x", 1, "[1x] is not a legal field name"),
        ("int8 x y", 1, "[x y] is not a legal field name"),
        ("int8 x[3]", 1, "[x[3]] is not a legal field name: an array is written int8[3] x"),
        ("int8 x []", 1, "[x []] is not a legal field name: an array is written int8[] x"),
        ("int8 x;", 1, "[x;] is not a legal field name: a line has no ; at its end"),
        ("int8 x, y", 1, "[x, y] is not a legal field name: each field has its own line"),
        ("int8 x // cm", 1, "[x // cm] is not a legal field name: a comment starts with #"),
        ("int8 my-x", 1, "[my-x] is not a legal field name: letters, digits and _; no -"),
        ("int8[a] x", 1, "neither"),
        ("int8[-1] x", 1, "neither"),
        ("a/b/c x", 1, "[a/b/c] is not a legal type"),
        ("int8 A=128", 1, "[128] is not a value of type int8"),
        ("uint8 A=-1", 1, "[-1] is not a value of type uint8"),
        ("int8 A=1.5", 1, "[1.5] is not a value of type int8"),
        ("int8[] A=1", 1, "a constant cannot be of type [int8[]]"),
        ("time A=1", 1, "a constant cannot be of type [time]"),
        ("Other A=1", 1, "a constant cannot be of type [p/Other]"),
    ],
)
def test_mistakes(text: str, line: int, error: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_message(text, "p", "M", "file.msg")
    assert (caught.value.file, caught.value.line) == ("file.msg", line)
    assert error in caught.value.text


@pytest.mark.parametrize(
    ("text", "request_fields", "response_fields"),
    [
        ("", [], []),
        ("int8 a", ["a"], []),
        ("---\n---\n", [], []),
        ("int8 a\n---\nint8 b\n---\nint8 c\n", ["a"], ["b", "c"]),
    ],
)
def test_a_service_of_any_number_of_parts(
    text: str, request_fields: list[str], response_fields: list[str]
) -> None:
    """Without `---` there is no response, and a second one is ignored, as in genmsg."""
    service = parse_service(text, "p", "S")
    assert [field.name for field in service.request.fields] == request_fields
    assert [field.name for field in service.response.fields] == response_fields


@pytest.mark.parametrize(("text", "parts"), [("int8 a", 0), ("---\n", 1), ("---\n---\n---\n", 3)])
def test_an_action_has_three_parts(text: str, parts: int) -> None:
    with pytest.raises(DefinitionError, match=f"{parts} lines of '---' instead of 2"):
        parse_action(text, "p", "A")


def test_lines_are_counted_over_all_parts() -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_service("int8 a\n---\nint8 b\nnonsense\n", "p", "S")
    assert caught.value.line == 4
    with pytest.raises(DefinitionError) as caught:
        parse_action("int8 a\n---\nint8 b\n---\nint8 c\nint8 c\n", "p", "A")
    assert caught.value.line == 6


@given(st.text("int8 aA=[]#/-1\n.x", max_size=40))
def test_any_text_is_parsed_or_refused(text: str) -> None:
    for parse in (parse_message, parse_service, parse_action):
        with contextlib.suppress(DefinitionError):
            parse(text, "p", "M")
