"""The memory that texts take, and the limits of JSON."""

from __future__ import annotations

import sys

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from minirospy.bridge.json_text import load_json, size_in_memory, width_of

WIDE = "\U0001f600"


def slow_width(text: str) -> int:
    """Return the width by looking at each character."""
    highest = max(map(ord, text), default=0)
    return 4 if highest > 0xFFFF else 2 if highest > 0xFF else 1


@given(st.text(max_size=20), st.integers(1, 60))
@example("", 1)
@example("a", 1000)
@example("\x80", 1)
@example("\xff", 1)
@example("\u0100", 1)
@example("\uffff", 1)
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
    # Not the text of the test itself, which may keep a copy in UTF-8.
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
    [(",", 8_000_000, "values"), ("[", 1_000_000, "values"), ("{", 1_000_000, "values")],
)
def test_values_lists_and_objects_are_limited(mark: str, most: int, what: str) -> None:
    """Marks within strings count, too: such a text is quickly parsed."""
    text = f'"{mark * most}"'
    assert load_json(text) == mark * most
    with pytest.raises(ValueError, match=f"more than {most} {what}"):
        load_json(f'"{mark * (most + 1)}"')


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
