"""Texts of clients, and their JSON, with limits: `[]` fifty million times would take gigabytes, and hold up all clients. Pure."""

from __future__ import annotations

import json
import re
import sys

__all__ = ["load_json", "size_in_memory", "width_of"]

_MOST_VALUES = 8_000_000
_MOST_COLLECTIONS = 1_000_000


_HEAD_SIZE = sys.getsizeof("\u0100") - 2 * 2
"""Bytes of a str that is not ASCII, without its characters and the one behind them."""

_BEYOND_LATIN = re.compile(rb"[\xc4-\xff]")
_BEYOND_BMP = re.compile(rb"[\xf0-\xff]")
_CONTINUATIONS = bytes(range(0x80, 0xC0))


def size_in_memory(data: bytes | bytearray) -> int:
    """Return the bytes that a text in UTF-8 takes as a str: one wide character makes each take two or four."""
    if data.isascii():
        return len(data)
    characters = len(data.translate(None, _CONTINUATIONS))
    if _BEYOND_BMP.search(data):
        return 4 * characters
    return 2 * characters if _BEYOND_LATIN.search(data) else characters


def width_of(text: str) -> int:
    """Return the bytes that each character of a text takes in memory: 1, 2 or 4."""
    if text.isascii():
        return 1
    if len(text) == 1:
        # Python 3.12 and later keep a copy in UTF-8 with these.
        return 1 if text <= "\xff" else 2 if text <= "\uffff" else 4
    # Such a copy of another text makes this too large at most.
    found = (sys.getsizeof(text) - _HEAD_SIZE) // (len(text) + 1)
    return found if found <= 2 else 4


def load_json(text: str | bytes) -> object:
    """Return the value of a text. Raise ValueError, also where it has too many values, and RecursionError."""
    if isinstance(text, str) and len(text) > _MOST_COLLECTIONS:
        # Also those within strings are counted: what is large is one string of base64, which has none.
        for marks, most in ((",", _MOST_VALUES), ("[{", _MOST_COLLECTIONS)):
            if sum(map(text.count, marks)) > most:
                raise ValueError(f"more than {most} values")
    found: object = json.loads(text)
    return found
