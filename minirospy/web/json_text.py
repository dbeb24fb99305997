"""Parse clients' JSON within limits, because fifty million `[]` would use gigabytes and block all clients. Pure.

The standard library's parser holds Python's global interpreter lock (GIL) until it has parsed the whole string, and so
blocks all threads of the process. Large strings are parsed in pieces instead, by :func:`load_json_in_pieces` in a separate
thread; large values are encoded in pieces, by :func:`dump_json_in_pieces`.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterator
from json.scanner import py_make_scanner  # type: ignore[attr-defined]

__all__ = [
    "MAX_QUICK_CHARACTERS",
    "dump_json",
    "dump_json_in_pieces",
    "is_quick_text",
    "load_json",
    "load_json_in_pieces",
    "size_in_memory",
    "width_of",
]

_MAX_VALUES = 4_000_000  # maximum number of values in a JSON string; if they are numbers, they take 160 MB
# maximum number of strings, including field names, in a JSON string; they take 150 MB
_MAX_STRINGS = 2_000_000
# maximum number of lists and objects in a JSON string; they take 100 to 240 MB
_MAX_COLLECTIONS = 1_000_000
# maximum length of any JSON string parsed on the event loop; parsing it takes at most 2 ms
MAX_QUICK_CHARACTERS = 64 * 1024
# maximum length of a JSON string with few values, such as a base64 image, parsed on the event loop
MAX_QUICK_STRINGS = 4 * 1024 * 1024
MAX_QUICK_VALUES = 20_000
PIECE_NUMBERS = 32 * 1024  # maximum length of a sequence of numbers parsed per call, in characters

_PIECE_VALUES = 1000  # maximum number of list values encoded per call; 1000 floats take 1 ms
_PIECE_CHARACTERS = 64 * 1024  # maximum number of a string's characters encoded per call

_SPACE = re.compile(r"[ \t\n\r]*")
_MARKS = re.compile(r'[\[\]{}"]')


_HEAD_SIZE = sys.getsizeof("\u0100") - 2 * 2
"""Size in bytes of an empty non-ASCII str, without the terminating character."""

_BEYOND_LATIN = re.compile(rb"[\xc4-\xff]")
_BEYOND_BMP = re.compile(rb"[\xf0-\xff]")
_CONTINUATIONS = bytes(range(0x80, 0xC0))


def size_in_memory(data: bytes | bytearray) -> int:
    """Return the memory in bytes that the str decoded from UTF-8 data takes.

    If one character is wide, every character takes two or four bytes.
    """
    if data.isascii():
        return len(data)
    characters = len(data.translate(None, _CONTINUATIONS))
    if _BEYOND_BMP.search(data):
        return 4 * characters
    return 2 * characters if _BEYOND_LATIN.search(data) else characters


def width_of(text: str) -> int:
    """Return how many bytes (1, 2 or 4) Python uses per character of a str in memory."""
    if text.isascii():
        return 1
    if len(text) == 1:
        # sys.getsizeof() is unusable for a single character, because since Python 3.12 it includes a UTF-8 copy.
        return 1 if ord(text) <= 0xFF else 2 if ord(text) <= 0xFFFF else 4
    # For longer strings, it also includes the UTF-8 copy, if there is one, so the result may be too large.
    found = (sys.getsizeof(text) - _HEAD_SIZE) // (len(text) + 1)
    return found if found <= 2 else 4


def is_quick_text(text: str) -> bool:
    """Return whether parsing a string takes only a few milliseconds."""
    if len(text) <= MAX_QUICK_CHARACTERS:
        return True
    # This also counts brackets and commas within strings, which is harmless: a large base64 string contains none.
    return len(text) <= MAX_QUICK_STRINGS and sum(map(text.count, ",[{")) <= MAX_QUICK_VALUES


def load_json(
    text: str | bytes, *, max_values: int = _MAX_VALUES, max_collections: int = _MAX_COLLECTIONS
) -> object:
    """Parse JSON. Raise ValueError if it is invalid or has too many values, or RecursionError if it is nested too deeply."""
    if isinstance(text, str):
        _check_counts(text, max_values, max_collections)
    found: object = json.loads(text)
    return found


def load_json_in_pieces(text: str) -> object:
    """Parse JSON like :func:`load_json`, but without holding the GIL for long.

    Use it in a thread alongside the event loop.
    """
    _check_counts(text, _MAX_VALUES, _MAX_COLLECTIONS)
    found: object = _PiecewiseDecoder().decode(text)
    return found


def _check_counts(text: str, max_values: int, max_collections: int) -> None:
    """Raise ValueError if a JSON string has too many values. Brackets and commas within strings also count."""
    for marks, most in ((",", max_values), ("[{", max_collections)):
        if len(text) > most and sum(map(text.count, marks)) > most:
            raise ValueError(f"more than {most} values")
    if len(text) > 2 * _MAX_STRINGS and text.count('"') > 2 * _MAX_STRINGS:
        raise ValueError(f"more than {_MAX_STRINGS} strings")


class _PiecewiseDecoder(json.JSONDecoder):
    """Python's own decoder, in pure Python so that other threads can run; parses long arrays of numbers in C."""

    def __init__(self) -> None:
        super().__init__()
        self.parse_array = _array
        self.scan_once = py_make_scanner(self)


def _array(start: tuple[str, int], scan_once: Callable[[str, int], tuple[object, int]]) -> tuple[object, int]:
    """Parse an array after its opening bracket; return the array, and the index of its end.

    Raise JSONDecodeError or StopIteration if it is invalid.
    """
    text, at = start
    values: list[object] = []
    at = _skip_space(text, at)
    if text[at : at + 1] == "]":
        return values, at + 1

    while True:
        mark = _MARKS.search(text, at, at + PIECE_NUMBERS)
        if mark and mark[0] == "]":
            return values + _numbers(text, at, mark.start()), mark.end()
        # Parse numbers up to the next value of another type, or up to the end of the piece.
        comma = text.rfind(",", at, mark.start() if mark else at + PIECE_NUMBERS)
        if comma >= 0:
            values += _numbers(text, at, comma)
            at = comma + 1
            if mark is None:
                continue

        try:
            value, at = scan_once(text, _skip_space(text, at))
        except StopIteration as error:
            raise json.JSONDecodeError("Expecting value", text, error.value) from None
        values.append(value)
        at = _skip_space(text, at)
        if text[at : at + 1] == "]":
            return values, at + 1
        if text[at : at + 1] != ",":
            raise json.JSONDecodeError("Expecting ',' delimiter", text, at)
        at += 1


def _skip_space(text: str, at: int) -> int:
    found = _SPACE.match(text, at)
    assert found
    return found.end()


def _numbers(text: str, start: int, end: int) -> list[object]:
    """Parse the values in a part of an array. Raise JSONDecodeError if there are none or one is invalid."""
    found: list[object] = json.loads(f"[{text[start:end]}]")
    if not found:
        raise json.JSONDecodeError("Expecting value", text, start)
    return found


# --- encoding


def dump_json(value: object) -> str:
    """Encode a value as compact JSON. Raise ValueError for NaN and infinities."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def dump_json_in_pieces(value: object) -> str:
    """Encode JSON like :func:`dump_json`, but without holding the GIL for long. For use in a thread other than the loop's.

    Dictionary keys must be strings.
    """
    return "".join(_pieces(value))


def _pieces(value: object) -> Iterator[str]:
    """Yield a value's JSON text in pieces."""
    if isinstance(value, dict):
        mark = "{"
        for name, each in value.items():
            yield f"{mark}{dump_json(name)}:"
            yield from _pieces(each)
            mark = ","
        yield "}" if value else "{}"
    elif isinstance(value, list):
        yield "["
        # Check only the first element, because the elements of a message's array all have the same type.
        is_nested = bool(value) and isinstance(value[0], dict | list | str)
        yield from _nested_elements(value) if is_nested else _numbers_of(value)
        yield "]"
    elif isinstance(value, str) and len(value) > _PIECE_CHARACTERS:
        yield '"'
        for at in range(0, len(value), _PIECE_CHARACTERS):
            yield dump_json(value[at : at + _PIECE_CHARACTERS])[1:-1]
        yield '"'
    else:
        yield dump_json(value)


def _numbers_of(values: list[object]) -> Iterator[str]:
    """Yield the JSON of a list's elements, which are numbers or null, with the commas between them."""
    for at in range(0, len(values), _PIECE_VALUES):
        yield ("," if at else "") + dump_json(values[at : at + _PIECE_VALUES])[1:-1]


def _nested_elements(values: list[object]) -> Iterator[str]:
    """Yield the JSON of the dictionaries, lists and strings in a list. Small elements are encoded in batches."""
    mark, batch, size = "", list[object](), 0
    for each in values:
        of_each = _size(each)
        if batch and size + of_each > _PIECE_VALUES:
            yield mark + dump_json(batch)[1:-1]
            mark, batch, size = ",", [], 0
        if of_each > _PIECE_VALUES:
            yield mark
            yield from _pieces(each)
            mark = ","
        else:
            batch.append(each)
            size += of_each
    if batch:
        yield mark + dump_json(batch)[1:-1]


def _size(value: object) -> int:
    """Return the cost of encoding a value; a number costs 1. Stop counting once the value is certain to be large."""
    if isinstance(value, str):
        return 1 + len(value) * _PIECE_VALUES // _PIECE_CHARACTERS
    if not isinstance(value, dict | list):
        return 1
    size = 1 + len(value)
    for each in value.values() if isinstance(value, dict) else value:
        if size > _PIECE_VALUES:
            break
        if isinstance(each, dict | list | str):
            size += _size(each)
    return size
