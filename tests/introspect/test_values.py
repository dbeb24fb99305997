"""YAML values as users type them: the fast parser agrees with the YAML library, and rejects bad input in one line."""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterator
from itertools import pairwise

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base import yaml_text
from minirospy.base.errors import ValueTextError
from minirospy.base.yaml_text import safe_load
from minirospy.introspect.values import (
    check_parameter,
    format_pretty,
    format_value,
    message_values,
    parse_arguments,
    parse_documents,
    parse_lines,
    parse_value,
)

WORDS = [
    "", "1", "-5", "0", "007", "010", "0x10", "1_000", "1:30", "1.5", "-1.5", ".5", "1.", "1e3", "1.0e3", "1.0e+3",
    "true", "True", "TRUE", "yes", "no", "on", "off", "null", "~", "y", "n", "hello", "hello world", "a/b", "/a/b",
    "a-b", "a: 1", "{x: 1, y: [2, three]}", "[1, 2.5, x]", "'1'", '"a"', ".inf", ".nan", "inf", "a#b", "a #b", "e5",
    "12345678901", "-0", "-", "-.5", "٣", "1.٣", "a٣", "-007", "00.5", "1.2.3", "/", "_", "//", "é_",
    "+5", "_x", "x_", "ünï", " 5 ", "5 6",
]  # fmt: skip


@pytest.mark.parametrize("text", WORDS)
def test_words_have_the_values_of_yaml(text: str) -> None:
    ours, theirs = parse_value(text), yaml.safe_load(text)
    assert type(ours) is type(theirs)
    assert ours == theirs or (isinstance(ours, float) and math.isnan(ours) and math.isnan(theirs))


@given(st.text(alphabet="0123456789.-+eE_truefalsnoy/:ax ", max_size=8))
def test_any_word_has_the_value_of_yaml(text: str) -> None:
    try:
        theirs = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError):
        with pytest.raises((ValueTextError, ValueError)):
            parse_value(text)
        return
    ours = parse_value(text)
    assert repr(ours) == repr(theirs)


@given(st.one_of(st.booleans(), st.integers(-(2**31), 2**31 - 1), st.floats(), st.text(max_size=20)))
def test_any_value_is_written_as_yaml_writes_it(value: object) -> None:
    assert format_value(value) == yaml.safe_dump(value).removesuffix("\n...\n")


def test_angles() -> None:
    assert parse_value("deg(90)") == math.pi / 2
    assert parse_value("rad(pi/2)") == math.pi / 2
    assert parse_value("deg(-45.0)") == -math.pi / 4
    assert parse_value("!degrees 180") == math.pi
    assert parse_value("{a: rad(2*pi), b: degree}") == {"a": 2 * math.pi, "b": "degree"}
    powers = ("rad(2**3)", "rad(2**-1)", "rad(-2**2)", "rad(7%4)", "rad(7//2)")
    assert [parse_value(text) for text in powers] == [8.0, 0.5, -4.0, 3.0, 3.0]
    with pytest.raises(ValueTextError, match="not an angle"):
        parse_value("!radians __import__('os')")
    # ROS reads every text with brackets inside the brackets as a string.
    assert parse_value("rad(__import__('os'))") == "rad(__import__('os'))"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("{data:[400, 300]}", {"data": [400, 300]}),
        ("{a:{b: deg(180)},c: 1}", {"a": {"b": math.pi}, "c": 1}),
        ("[a:[1]]", [{"a": [1]}]),
        ("{a:,b: 1}", {"a": None, "b": 1}),
    ],
)
def test_a_colon_directly_before_a_bracket_is_accepted_as_in_ros(text: str, value: object) -> None:
    assert value == parse_value(text) == yaml.safe_load(text.replace("deg(180)", repr(math.pi)))
    assert list(parse_documents(f"a: 1\n---\n{text}\n---\nb\n", "it")) == [{"a": 1}, value, "b"]


@pytest.mark.parametrize(
    "text",
    [
        "{data:[" + "[1], " * 300 + "]}",
        "{a: &x {b:[1, 2]}, c: [*x, *x]}",
        "{a:[" * 40 + "1" + "]}" * 40 + "\n" + "# [" * 200,
    ],
)
def test_such_a_colon_is_accepted_with_many_brackets_or_aliases(text: str) -> None:
    assert parse_value(text) == yaml.safe_load(text)
    assert yaml_text.safe_load(text) == yaml.safe_load(text)


@pytest.mark.parametrize(
    "text",
    [
        "{a:[" * 150 + "1" + "]}" * 150,
        "{a:[1], b: &b [1,1,1,1,1,1,1,1,1,1], "
        + ", ".join(
            f"{name}: &{name} [{', '.join([f'*{below}'] * 10)}]" for below, name in pairwise("bcdefgh")
        )
        + "}",
    ],
)
def test_limits_hold_with_such_a_colon(text: str) -> None:
    with pytest.raises(ValueTextError):
        parse_value(text)


def test_text_that_no_yaml_library_accepts_after_such_a_colon_is_refused() -> None:
    found = parse_documents("a: 1\n---\n{a:[1}\n", "it")
    assert next(found) == {"a": 1}
    with pytest.raises(ValueTextError, match="found unexpected ':'"):
        next(found)
    with pytest.raises(ValueTextError, match="found unexpected ':'"):
        parse_value("{a:[1}")


@pytest.mark.parametrize("text", ["rad(9**9**9)", "!radians (-1)**0.5", "deg(0**-1)", "rad(7%0)"])
def test_an_angle_without_a_value_is_refused(text: str) -> None:
    with pytest.raises(ValueTextError, match="not an angle"):
        parse_value(text)


def test_bad_text_is_one_line_with_the_place() -> None:
    with pytest.raises(ValueTextError) as caught:
        parse_value("data: [True")
    assert str(caught.value).startswith("'data: [True': ")
    assert "line " in str(caught.value)
    assert "\n" not in str(caught.value)
    with pytest.raises(ValueTextError, match=r"'params\.yaml': "):
        list(parse_documents("a: 1\n---\nb: [", "params.yaml"))


def test_documents() -> None:
    assert list(parse_documents("a: 1\n---\n- 2\n", "f")) == [{"a": 1}, [2]]


def test_pretty() -> None:
    value = {
        "b": False, "d": {"el": [], "q": {"r": 1.5}}, "e": "", "l": [1, "a: b", [2, 3]], "ml": "abc\ndef", "n": "5",
        "s": "l1\nl2\n", "u": "ünï", "y": "yes",
    }  # fmt: skip
    # Real `rosparam get -p` prints the same.
    assert format_pretty(value) == (
        "b: false\nd:\n  el: []\n  q:\n    r: 1.5\ne: \nl: - 1\n- 'a: b'\n- - 2\n  - 3\n"
        "ml: |\n  abc\n  def\nn: 5\ns: |\n  l1\n  l2\n  \nu: ünï\ny: yes"
    )
    assert format_pretty("5") == "5"
    assert format_pretty([1]) == "- 1\n"


def test_values_that_a_parameter_cannot_hold_are_refused() -> None:
    check_parameter({"a": [1, "x", 2.5, True, b"\0"]}, "/p")
    for value, why in (
        (None, "null"),
        ({"a": None}, "null"),
        (2**31, "32 bits"),
        ([2**31], "32 bits"),
        ({1: 2}, "quotes"),
        (yaml.safe_load("2020-01-01"), "date"),
    ):
        with pytest.raises(ValueTextError, match=why):
            check_parameter(value, "/p")


def test_documents_of_a_pipe_come_one_by_one() -> None:
    def lines() -> Iterator[str]:
        yield from ("data: 1\n", "---\n")
        read.append("second")
        yield from ("- 2\n", "- 3\n", "---\n", "---\n", "x\n")

    read: list[str] = []
    documents = message_values(parse_lines(lines(), "standard input"))
    assert next(documents) == [{"data": 1}]
    assert not read
    assert list(documents) == [[2, 3], ["x"]]


def test_an_empty_argument_is_the_empty_text() -> None:
    assert parse_arguments(["", "1", "a b", "{x: 1}"]) == ["", 1, "a b", {"x": 1}]


BOMBS = {
    "brackets": "[" * 100_000,
    "braces": "{a: " * 100_000,
    "dashes": "- " * 100_000 + "a",
    "questions": "? " * 100_000 + "a",
    "indents": "\n".join(" " * level + "a:" for level in range(1000)),
    "laughs": "\n".join(
        ["a0: &a0 [x]", *(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 12))]
    ),
    "laughs of keys": "\n".join(
        ["a0: &a0 {x: y}", *(f"a{n}: &a{n} {{b: *a{n - 1}, c: *a{n - 1}}}" for n in range(1, 40))]
    ),
    "merged laughs": "\n".join(
        [
            "a0: &a0 {x: y}",
            *(f"a{n}: &a{n} {{b: {{<<: *a{n - 1}}}, c: {{<<: *a{n - 1}}}}}" for n in range(1, 40)),
        ]
    ),
    "itself": "&a [*a]",
    "itself as a key": "&a {b: {c: *a}}",
}


@pytest.mark.parametrize("text", BOMBS.values(), ids=list(BOMBS))
def test_yaml_that_explodes_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(ValueTextError) as raised:
        parse_value(text)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 200
    with pytest.raises(ValueTextError):
        list(parse_documents(text, "file.yaml"))


@pytest.mark.parametrize(
    "text", ["rad(" + "1+" * 500 + "1)", "deg(" + "-" * 5000 + "1)", "deg(" + "9" * 5000 + ")"]
)
def test_angle_that_explodes_is_refused(text: str) -> None:
    with pytest.raises(ValueTextError):
        parse_value(text)


def test_aliases_and_many_brackets_are_read() -> None:
    assert parse_value("a: &x [1, 2]\nb: [*x, *x]\n") == {"a": [1, 2], "b": [[1, 2], [1, 2]]}
    assert parse_value("base: &x {p: 1}\nrobot: {<<: *x, q: 2}\n")["robot"] == {"p": 1, "q": 2}
    assert len(parse_value("[" + "[1], " * 5000 + "]")) == 5000
    deep = parse_value("[" * 150 + "]" * 150)
    for _ in range(149):
        (deep,) = deep
    assert deep == []


LONG_NUMBERS = {
    "base 60": "1" + ":59" * 100_000,
    "base 60 with decimals": "1" + ":59" * 300 + ".5",
    "decimal": "1" * 5_000,
    "hexadecimal": "0x" + "f" * 5_000,
    "binary": "0b" + "1" * 100_000,
    "with a tag": "!!int '" + "1" * 5_000 + "'",
    "no date": "2001-99-99",
    "no number": "!!int x",
    "no truth": "!!bool x",
    "no time": "!!timestamp x",
}


@pytest.mark.parametrize("text", LONG_NUMBERS.values(), ids=list(LONG_NUMBERS))
def test_numbers_that_take_hours_or_are_none_are_refused_in_one_line(text: str) -> None:
    with pytest.raises(ValueTextError) as raised:
        parse_value(text)
    assert "\n" not in raised.value.why
    assert len(raised.value.why) < 200
    with pytest.raises(ValueTextError, match="f"):
        list(parse_documents(f"a: [1, {text}]", "f"))
    with pytest.raises(yaml.YAMLError):
        yaml_text.safe_load(text)


@pytest.mark.parametrize(
    "text", ["1:30", "190:20:30", "-1:30:15.5", "1" * 300, "1" * 300 + ".5", "x" * 5_000]
)
def test_numbers_of_usual_length_are_those_of_yaml(text: str) -> None:
    assert parse_value(text) == yaml.safe_load(text)
    assert yaml_text.safe_load(text) == yaml.safe_load(text)


def test_a_loader_that_learns_later_is_guarded_too() -> None:
    class Loader(yaml.SafeLoader):
        pass

    with pytest.raises(yaml.YAMLError):
        yaml_text.load("!a 1", Loader)
    Loader.add_constructor("!a", lambda loader, node: "learned")
    assert yaml_text.load("!a 1", Loader) == "learned"


def test_a_long_integer_is_no_parameter_and_not_shown_in_full() -> None:
    with pytest.raises(ValueTextError, match=r"1{40}\.\.\. is more than a parameter's 32 bits hold$"):
        check_parameter({"a": int("1" * 900)}, "/n")


@pytest.mark.parametrize("value", [None, 0.5, object()])
def test_non_string_raises_type_error_as_in_pyyaml(value: object) -> None:
    with pytest.raises(TypeError, match="YAML is a text, not "):
        yaml_text.safe_load(value)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="YAML is a text, not "):
        list(parse_documents(value, "file"))  # type: ignore[arg-type]


def test_binary_is_read_as_bytes_even_if_rosparam_has_changed_pyyaml() -> None:
    importlib.import_module("rosparam")
    assert safe_load("!!binary aGk=") == b"hi"
