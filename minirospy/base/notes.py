"""Add advice to an exception that another library raised, without changing its text, which programs may compare."""

from __future__ import annotations

import sys
from typing import TypeVar

__all__ = ["noted"]

_E = TypeVar("_E", bound=BaseException)


def noted(error: _E, note: str) -> _E:
    """Add a note (PEP 678) to an error; return the error. Tracebacks show the note last, except in Python 3.10."""
    if sys.version_info >= (3, 11):
        error.add_note(f"minirospy: {note}")
    return error
