"""JSON of clients, with a limit: a text of `[]` fifty million times would take gigabytes, and hold up all clients. Pure."""

from __future__ import annotations

import json

__all__ = ["load_json"]

_MOST_VALUES = 8_000_000
_MOST_COLLECTIONS = 1_000_000


def load_json(text: str | bytes) -> object:
    """Return the value of a text. Raise ValueError, also where it has too many values, and RecursionError."""
    if isinstance(text, str) and len(text) > _MOST_COLLECTIONS:
        # Also those within strings are counted: what is large is one string of base64, which has none.
        for marks, most in ((",", _MOST_VALUES), ("[{", _MOST_COLLECTIONS)):
            if sum(map(text.count, marks)) > most:
                raise ValueError(f"more than {most} values")
    found: object = json.loads(text)
    return found
