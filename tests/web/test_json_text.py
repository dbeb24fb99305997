"""Strings from clients: their memory use, JSON with limits, and the incremental parser compared with the library's."""

from __future__ import annotations

import json
import math
import random
import sys
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from minirospy.web import json_text
from minirospy.web.json_text import (
    MAX_QUICK_CHARACTERS,
    MAX_QUICK_STRINGS,
    MAX_QUICK_VALUES,
    dump_json,
    dump_json_in_pieces,
    is_quick_text,
    load_json,
    load_json_in_pieces,
    size_in_memory,
    width_of,
)

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=30,
)
ALPHABET = '[]{}",:01.e-+ \n\\atrufalsn'


def outcome(load: Any, text: str) -> str:
    """Return a parser's result: the value's repr, which also compares NaN, or the fact that the string was refused."""
    try:
        return repr(load(text))
    except (ValueError, RecursionError):
        return "refused"


@pytest.fixture(autouse=True)
def _small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(json_text, "PIECE_NUMBERS", 8)


@given(VALUES, st.sampled_from([None, 0, 3]), st.booleans())
def test_pieces_give_the_same_results_as_the_library(
    value: object, indent: int | None, is_ascii: bool
) -> None:
    text = json.dumps(value, indent=indent, ensure_ascii=is_ascii)
    assert outcome(load_json_in_pieces, text) == outcome(json.loads, text)


@given(st.text(ALPHABET, max_size=40))
def test_values_refused_by_the_library_are_refused(text: str) -> None:
    assert outcome(load_json_in_pieces, text) == outcome(json.loads, text)


def test_mutations_give_the_same_results_as_the_library() -> None:
    chosen = random.Random(1)
    base = json.dumps(
        {"op": "publish", "msg": {"data": [1.5, -2, 3e9] * 8, "points": [{"x": 1}, [], [2, "a,]"]] * 3}}
    )
    for _ in range(20_000):
        letters = list(base)
        for _ in range(chosen.randrange(1, 4)):
            at = chosen.randrange(len(letters))
            letters[at : at + chosen.randrange(2)] = chosen.choice(ALPHABET)
        text = "".join(letters)
        assert outcome(load_json_in_pieces, text) == outcome(json.loads, text), text


@pytest.mark.parametrize(
    "text",
    [
        "[1,2,3,4,5,6,7,8,]",
        "[1,          ,2]",
        "[,1]",
        "[1 2,3,4,5,6]",
        "[" + "[" * 5000,
        '["a" "b"]',
        "[1,2",
        "[NaN,1,]",
    ],
)
def test_broken_arrays_are_refused(text: str) -> None:
    assert outcome(load_json_in_pieces, text) == outcome(json.loads, text) == "refused"


def test_one_call_of_the_library_parses_a_piece_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    lengths: list[int] = []
    loads = json.loads

    def noting(text: str) -> Any:
        lengths.append(len(text))
        return loads(text)

    monkeypatch.setattr(json, "loads", noting)
    value = {"a": [[]] * 100 + [1.5] * 1000 + ["s"] * 50 + [2] * 1000}
    assert load_json_in_pieces(json.dumps(value)) == value
    assert lengths
    assert max(lengths) <= 8 + 2


@pytest.mark.parametrize(
    ("text", "calls"),
    [
        ("[1,2]", ["[1,2]"]),
        ("[1,2,3,4,5,6]", ["[1,2,3,4]", "[5,6]"]),
        ("[1,2,[3,4],5]", ["[1,2]", "[3,4]", "[5]"]),
        ('[1,"a",2,3]', ["[1]", "[2,3]"]),
        ("[123456789,1,2,3,4,5,6]", ["[1,2,3,4]", "[5,6]"]),
        ("[[]]", []),
    ],
)
def test_library_parses_the_numbers_between_other_values(
    text: str, calls: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A piece has eight characters and ends after a comma; a longer number is parsed by itself."""
    found: list[str] = []
    loads = json.loads

    def noting(part: str) -> Any:
        found.append(part)
        return loads(part)

    monkeypatch.setattr(json, "loads", noting)
    assert load_json_in_pieces(text) == loads(text)
    assert found == calls


def test_too_many_values_are_refused() -> None:
    for load in (load_json, load_json_in_pieces):
        with pytest.raises(ValueError, match="more than 1000000 values"):
            load("[" + "[]," * 1_000_000 + "0]")
    with pytest.raises(ValueError, match="more than 10 values"):
        load_json("[" + "1," * 11 + "0]", max_values=10)
    with pytest.raises(ValueError, match="more than 5 values"):
        load_json("[[],[],[],[],[],[]]", max_collections=5)
    assert math.isnan(load_json("NaN"))  # type: ignore[arg-type]


def test_large_texts_of_few_values_are_quick() -> None:
    assert is_quick_text("[" + "[]," * 20_000 + "0]")
    assert not is_quick_text("[" + "[]," * 30_000 + "0]")
    assert is_quick_text('{"data": "' + "A" * 2_000_000 + '"}')
    assert not is_quick_text('{"data": "' + "A" * 5_000_000 + '"}')


@pytest.mark.parametrize("mark", [",", "[", "{"])
def test_limits_of_quick_texts_are_exact(mark: str) -> None:
    assert is_quick_text(mark * MAX_QUICK_CHARACTERS)
    assert not is_quick_text(mark * (MAX_QUICK_CHARACTERS + 1))
    assert is_quick_text((mark * MAX_QUICK_VALUES).ljust(MAX_QUICK_STRINGS, "X"))
    assert not is_quick_text((mark * (MAX_QUICK_VALUES + 1)).ljust(MAX_QUICK_STRINGS, "X"))
    assert not is_quick_text("X" * (MAX_QUICK_STRINGS + 1))


WIDE = "\U0001f600"


def slow_width(text: str) -> int:
    """Return the width by checking each character."""
    highest = max(map(ord, text), default=0)
    return 4 if highest > 0xFFFF else 2 if highest > 0xFF else 1


@given(st.text(max_size=20), st.integers(1, 60))
@example("", 1)
@example("a", 1000)
@example("\x80", 1)
@example("\xff", 1)
@example("\xff", 2)
@example("\u0100", 1)
@example("\uffff", 1)
@example("\uffff", 2)
@example("\U00010000", 1)
@example("\xff", 99)
@example("\xff", 100)
@example("\u0100", 99)
@example("\u0100", 100)
@example("\uffff", 100)
@example("\U00010000", 100)
@example(WIDE, 1)
def test_width_and_size_are_those_of_memory(part: str, times: int) -> None:
    text = part * times
    assert width_of(text) == slow_width(text)
    # Do not use the test's own string, which may have a cached copy in UTF-8.
    made = "".join(text)
    assert size_in_memory(text.encode(errors="surrogatepass")) == slow_width(made) * len(made)


def test_one_wide_character_makes_a_text_four_times_as_large() -> None:
    data = b"a" * 100_000
    assert size_in_memory(data) == 100_000
    data += WIDE.encode()
    assert size_in_memory(data) == size_in_memory(bytearray(data)) == 4 * 100_001
    assert sys.getsizeof(data.decode()) > 400_000


@pytest.mark.parametrize(
    ("mark", "most", "what"),
    [(",", 4_000_000, "values"), ("[", 1_000_000, "values"), ("{", 1_000_000, "values")],
)
def test_values_lists_and_objects_are_limited(mark: str, most: int, what: str) -> None:
    """Brackets and commas inside strings count too, because such text is parsed quickly."""
    text = f'"{mark * most}"'
    for load in (load_json, load_json_in_pieces):
        assert load(text) == mark * most
        with pytest.raises(ValueError, match=f"more than {most} {what}"):
            load(f'"{mark * (most + 1)}"')


def test_strings_are_limited() -> None:
    """Each string takes more memory than a number; names of fields count as well."""
    text = "[0" + ',""' * 1_999_999
    assert load_json(f'{text},""]') == [0] + [""] * 2_000_000
    with pytest.raises(ValueError, match="more than 2000000 strings"):
        load_json(f'{text},{{"":""}}]')


def test_only_marks_count_as_values() -> None:
    text = '"' + "X" * 100 + '"'
    assert load_json(text, max_values=10, max_collections=10) == "X" * 100


def test_short_text_may_have_too_many_strings() -> None:
    with pytest.raises(ValueError, match="more than 2000000 strings"):
        load_json('"' * 4_000_001)


def test_lists_and_objects_count_together() -> None:
    text = '"' + "[" * 600_000 + "{" * 400_000
    assert load_json(f'{text}"')
    with pytest.raises(ValueError, match="more than 1000000 values"):
        load_json(f'{text}{{"')


def test_short_texts_and_bytes_are_only_parsed() -> None:
    assert load_json('{"a": [1, 2.5, null]}') == {"a": [1, 2.5, None]}
    assert load_json(b"[]") == []
    with pytest.raises(ValueError, match="Expecting value"):
        load_json("")


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


@given(_VALUES)
def test_text_in_pieces_is_that_of_the_library(value: object) -> None:
    assert dump_json_in_pieces(value) == dump_json(value) == json.dumps(value, separators=(",", ":"))


@pytest.mark.parametrize(
    "value",
    [
        [0.1 * number for number in range(100_000)],
        [None] * 2001,
        {"data": 'a\U0001f600"\\\n' * 50_000, "empty": [[], {}, ""]},
        {"points": [{"x": 1.5, "y": number, "z": "\xe4"} for number in range(5000)]},
        [["a" * 70_000, "b"], ["c"] * 3000, [1] * 3000, [], [{"d": [0.5] * 5000}]],
        ["a" * 100] * 2000,
    ],
)
def test_large_value_becomes_a_text_in_pieces(value: object, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = dump_json(value)
    longest = 0

    def dump(part: object) -> str:
        nonlocal longest
        text = dump_json(part)
        longest = max(longest, len(text))
        return text

    monkeypatch.setattr(json_text, "dump_json", dump)
    assert dump_json_in_pieces(value) == expected
    # The piece has 65,536 characters, each of which may become a pair of escapes.
    assert longest <= 12 * 65_536
    assert len(expected) < 13 * 65_536 or longest < len(expected) / 2


@pytest.mark.parametrize(
    ("value", "pieces"),
    [
        ([1] * 10, ["[", ",".join("1" * 10), "]"]),
        ([1] * 21, ["[", ",".join("1" * 10), "," + ",".join("1" * 10), ",1", "]"]),
        ("x" * 40, [f'"{"x" * 40}"']),
        ("x" * 41, ['"', "x" * 40, "x", '"']),
        ({}, ["{}"]),
        ({"a": 1, "b": []}, ['{"a":', "1", ',"b":', "[", "]", "}"]),
        # Each string counts as one value, plus one for every four characters.
        ([""] * 10, ["[", ",".join(['""'] * 10), "]"]),
        (["abc"] * 21, ["[", ",".join(['"abc"'] * 10), "," + ",".join(['"abc"'] * 10), ',"abc"', "]"]),
        (["abcd"] * 6, ["[", ",".join(['"abcd"'] * 5), ',"abcd"', "]"]),
        (["x" * 39], ["[", f'"{"x" * 39}"', "]"]),
        (["x" * 40], ["[", "", f'"{"x" * 40}"', "]"]),
        (["", "x" * 40, ""], ["[", '""', ",", f'"{"x" * 40}"', ',""', "]"]),
        (["x" * 40, "", "x" * 40], ["[", "", f'"{"x" * 40}"', ',""', ",", f'"{"x" * 40}"', "]"]),
        (["", *[1] * 10], ["[", '"",' + ",".join("1" * 9), ",1", "]"]),
        # Each list or dictionary counts as one value, plus one for each element, plus the strings and lists in it.
        ([[]] * 11, ["[", ",".join(["[]"] * 10), ",[]", "]"]),
        ([[1]] * 6, ["[", ",".join(["[1]"] * 5), ",[1]", "]"]),
        ([{"a": 1}] * 6, ["[", ",".join(['{"a":1}'] * 5), ',{"a":1}', "]"]),
        ([[1] * 9], ["[", f"[{','.join('1' * 9)}]", "]"]),
        ([[1] * 10], ["[", "", "[", ",".join("1" * 10), "]", "]"]),
        ([["x" * 39]], ["[", "", "[", f'"{"x" * 39}"', "]", "]"]),
        ([["x" * 28]], ["[", f'["{"x" * 28}"]', "]"]),
        ([[""] * 4], ["[", '["","","",""]', "]"]),
        ([[""] * 5], ["[", "", "[", '"","","","",""', "]", "]"]),
        ([{"a": [1] * 7}], ["[", '{"a":[1,1,1,1,1,1,1]}', "]"]),
        ([{"a": [1] * 8}], ["[", "", '{"a":', "[", ",".join("1" * 8), "]", "}", "]"]),
    ],
)
def test_pieces_are_as_large_as_allowed(
    value: object, pieces: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(json_text, "_PIECE_VALUES", 10)
    monkeypatch.setattr(json_text, "_PIECE_CHARACTERS", 40)
    assert list(json_text._pieces(value)) == pieces
    assert "".join(pieces) == dump_json(value)


@pytest.mark.parametrize(("length", "size", "counted"), [(2000, 2001, 1), (800, 1001, 201), (500, 1001, 500)])
def test_size_of_a_large_value_is_not_counted_to_the_end(length: int, size: int, counted: int) -> None:
    read = 0

    class Values(list[object]):
        def __iter__(self) -> Iterator[object]:
            nonlocal read
            for each in super().__iter__():
                read += 1
                yield each

    assert json_text._size(Values([""] * length)) == size
    assert read == counted


def test_values_that_are_no_json_are_refused_in_pieces_too() -> None:
    with pytest.raises(ValueError, match="JSON compliant"):
        dump_json_in_pieces({"a": [0.5, float("nan")]})
