"""Long work in short steps: generators that yield about once a millisecond, so that other work can run in between.

``runtime/rpc/turns.py`` runs them on an event loop; :func:`finish` runs them without interruption.
"""

from __future__ import annotations

from collections.abc import Generator
from enum import Enum
from typing import TypeVar

__all__ = ["ALONE", "PAUSE", "SHORT_ITEMS", "SMALL_ITEMS", "Need", "Steps", "finish", "is_small"]

_T = TypeVar("_T")


class Need(Enum):
    """A scheduling request that a step yields instead of None: to run alone, or to pause."""

    ALONE = "no other work that takes much memory may run beside this"
    PAUSE = "there is nothing to do at present"


ALONE, PAUSE = Need

Steps = Generator[Need | None, None, _T]  # a generator that yields between its steps and returns its result

SMALL_ITEMS = 2000  # number of items that take a few milliseconds to serialize

SHORT_ITEMS = 300
"""Number of items that take about 0.1 ms to serialize, which is short even if a thousand clients request them at the same
time.
"""

_LETTERS_PER_ITEM = 16


def finish(steps: Steps[_T]) -> _T:
    """Run the steps without interruption and return their result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: _T = end.value
            return result


def is_small(value: object, most: int = SMALL_ITEMS) -> bool:
    """Return whether an XML-RPC value has at most about ``most`` items. Long strings count as many items."""
    return _left(value, most) >= 0


def _left(value: object, left: int) -> int:
    """Return ``left`` minus the number of items in ``value``; the result may be negative."""
    if isinstance(value, (str, bytes)):
        return left - 1 - len(value) // _LETTERS_PER_ITEM
    if not isinstance(value, (list, tuple, dict)):
        return left - 1
    left -= 1 + len(value)
    if left < 0:
        return left
    if isinstance(value, dict):
        for key in value:
            left -= len(key) // _LETTERS_PER_ITEM if isinstance(key, str) else 0
        value = value.values()
    for item in value:
        if isinstance(item, (str, bytes, list, tuple, dict)):
            left = _left(item, left)
            if left < 0:
                break
    return left
