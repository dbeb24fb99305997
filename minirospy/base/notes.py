"""Add advice to an exception whose text is that of another library, so that programs can still compare the text."""

from __future__ import annotations

import sys
from typing import TypeVar

__all__ = ["noted"]

_E = TypeVar("_E", bound=BaseException)


def noted(error: _E, note: str) -> _E:
    """Return an error whose traceback ends with a note (PEP 678). Python 3.10 shows no notes."""
    if sys.version_info >= (3, 11):
        error.add_note(f"minirospy: {note}")
    return error
