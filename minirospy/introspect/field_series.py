"""Follow a plot's path into messages, such as ``/position[elbow]``, ``/pose/orientation/yaw``, ``/points[:]{id==2}/x``.

Pure. The syntax is the same as in the dashboard's page (``page/js/paths.js``), after the topic's name;
``tests/web/page/paths.json`` tests both. Rotations are in radians, times in seconds.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from minirospy.base.errors import UsageError

__all__ = ["Filter", "Named", "Slice", "Step", "parse_steps", "select"]

_MAX_VALUES = 50  # maximum number of series per path, for example for a whole array
_MAX_TESTED = 10_000  # maximum number of elements that a filter tests
_MAX_PATH = 1_000  # maximum length of a path in characters; finding the end of a step takes quadratic time
_MAX_STEPS = 50  # maximum number of steps per path, for example for messages within messages

_STEP = re.compile(
    r"[/.](?P<name>\w+)|\[(?P<index>-?\d{1,9})\]|\[(?P<first>\d{0,9}):(?P<last>\d{0,9})\]"
    r"|\{(?P<path>[\w./]+)\s*(?P<operator>==|!=|<=?|>=?)\s*(?:\"(?P<double>[^\"]*)\"|'(?P<single>[^']*)'|(?P<bare>[^}\"']+))\}"
    r"|\[(?:\"(?P<quoted>[^\"\][]+)\"|'(?P<apostrophe>[^'\][]+)'|(?P<word>[^\][:\"']*[^\][:\"'\d-][^\][:\"']*))\]",
    re.ASCII,
)
_TESTS: dict[str, Callable[[Any, Any], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


class Slice(NamedTuple):
    """Array elements from ``first`` up to, but not including, ``last`` (None: to the end)."""

    first: int
    last: int | None


class Named(NamedTuple):
    """Selects an array element by name: its index is that of the name in the message's array of strings, ``name``."""

    name: str


class Filter(NamedTuple):
    """Selects elements by comparing a field with a value. ``text`` is the source text."""

    fields: tuple[str, ...]
    compare: Callable[[Any, Any], bool]
    wanted: float | str
    text: str

    def accepts(self, value: object) -> bool:
        """Return whether an element's field passes the filter."""
        for name in self.fields:
            if name not in _slots(value):
                return False
            value = getattr(value, name)
        if isinstance(self.wanted, str):
            return self.compare(str(value), self.wanted)
        number = _number(value)
        return self.compare is operator.ne if number is None else self.compare(number, self.wanted)


Step = str | int | Slice | Named | Filter


def parse_steps(text: str) -> list[Step]:
    """Parse the steps that follow the topic in a path. Raise UsageError if the syntax is invalid."""
    if len(text) > _MAX_PATH:
        raise UsageError(f"a path behind its topic has at most {_MAX_PATH:,} characters")
    steps: list[Step] = []
    at = 0
    while at < len(text):
        match = _STEP.match(text, at)
        if not match:
            raise UsageError(f'"{text[at:]}" is not a field, nor an index, nor a filter as {{id==1}}')
        found = match.groupdict()
        if found["name"] is not None:
            steps.append(found["name"])
        elif found["index"] is not None:
            steps.append(int(found["index"]))
        elif found["path"] is not None:
            steps.append(_filter(found, match.group()))
        elif found["first"] is not None:
            steps.append(Slice(int(found["first"] or 0), int(found["last"]) if found["last"] else None))
        else:
            steps.append(Named(found["quoted"] or found["apostrophe"] or found["word"]))
        if len(steps) > _MAX_STEPS:
            raise UsageError(f"a path behind its topic has at most {_MAX_STEPS} steps")
        at = match.end()
    return steps


def _filter(found: Mapping[str, str], text: str) -> Filter:
    wanted: float | str = next(
        each for name in ("double", "single", "bare") if (each := found[name]) is not None
    ).strip()
    if found["bare"] is not None:
        if wanted in ("true", "false"):
            wanted = float(wanted == "true")
        else:
            try:
                wanted = float(wanted)
            except ValueError:
                pass
    return Filter(tuple(re.split(r"[./]", found["path"])), _TESTS[found["operator"]], wanted, text)


def select(
    value: object, steps: Sequence[Step], label: str = "", depth: int = 0
) -> Iterator[tuple[str, float]]:
    """Yield (label, value) for each number that the steps select in a message."""
    if depth == len(steps):
        yield from _leaves(value, label)
        return
    step = steps[depth]
    if isinstance(step, str):
        yield from _select_field(value, step, steps, label, depth)
    elif isinstance(step, Filter):
        if step.accepts(value):
            yield from select(value, steps, label + step.text, depth + 1)
    elif isinstance(step, Named) or not isinstance(value, list | tuple | bytes):
        return
    elif isinstance(step, int):
        if -len(value) <= step < len(value):
            yield from select(value[step], steps, f"{label}[{step}]", depth + 1)
    else:
        # All elements that pass a filter form a single series, regardless of their indexes.
        is_filtered = isinstance(steps[depth + 1] if depth + 1 < len(steps) else None, Filter)
        last = len(value) if step.last is None else min(step.last, len(value))
        last = min(last, step.first + (_MAX_TESTED if is_filtered else _MAX_VALUES))
        for index in range(step.first, last):
            yield from select(value[index], steps, f"{label}[{':' if is_filtered else index}]", depth + 1)


def _select_field(
    value: object, name: str, steps: Sequence[Step], label: str, depth: int
) -> Iterator[tuple[str, float]]:
    if name in _slots(value):
        inner = getattr(value, name)
        following = steps[depth + 1] if depth + 1 < len(steps) else None
        if not isinstance(following, Named):
            yield from select(inner, steps, f"{label}/{name}", depth + 1)
            return
        names = getattr(value, "name", None)
        if isinstance(names, list | tuple) and isinstance(inner, list | tuple | bytes):
            try:
                index = names.index(following.name)
            except ValueError:
                return
            if index < len(inner):
                yield from select(inner[index], steps, f"{label}/{name}[{following.name}]", depth + 2)
    elif depth + 1 == len(steps) and (angle := _angle(value, name)) is not None:
        yield f"{label}/{name}", angle


def _leaves(value: object, label: str) -> Iterator[tuple[str, float]]:
    number = _number(value)
    if number is not None:
        yield label, number
    elif isinstance(value, list | tuple | bytes):
        for index, each in enumerate(value[:_MAX_VALUES]):
            if (number := _number(each)) is not None:
                yield f"{label}[{index}]", number
    else:
        # As in rqt_plot, a path to a message selects the numeric fields directly in it.
        for name in _slots(value):
            if (number := _number(getattr(value, name))) is not None:
                yield f"{label}/{name}", number


def _slots(value: Any) -> Sequence[str]:
    # Check the class, because a message's __getattr__ is slow for missing names.
    kind = type(value)
    if hasattr(kind, "_type"):
        slots: Sequence[str] = kind.__slots__
        return slots
    return ("secs", "nsecs") if hasattr(kind, "to_nsec") else ()


def _number(value: Any) -> float | None:
    """Convert a number to a float, and a time or duration to seconds; return None for any other value."""
    if isinstance(value, int | float):
        return float(value)
    if hasattr(type(value), "to_nsec"):
        return float(value.to_sec())
    return None


def _angle(value: Any, name: str) -> float | None:
    """Return a quaternion's roll, pitch or yaw. Return None for any other ``name``, or if the value is not a rotation."""
    if name not in ("roll", "pitch", "yaw") or not {"x", "y", "z", "w"} <= {*_slots(value)}:
        return None
    parts = [_number(each) for each in (value.x, value.y, value.z, value.w)]
    if None in parts:
        return None
    size = math.hypot(*(each for each in parts if each is not None))
    # An all-zero quaternion, found in messages that were not filled in, is not a rotation.
    if not 0 < size < math.inf:
        return None
    x, y, z, w = (each / size for each in parts if each is not None)
    if name == "roll":
        return math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    if name == "pitch":
        return math.asin(min(1.0, max(-1.0, 2 * (w * y - z * x))))
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
