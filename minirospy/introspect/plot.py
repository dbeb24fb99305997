"""Format messages as rows of comma-separated values, as `rostopic echo -p` does for plotting tools.

Pure. Arrays become columns with the index at the end; byte arrays are left out, because they cannot be plotted. Source:
http://wiki.ros.org/rostopic#rostopic_echo (-p).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

__all__ = ["plot_header", "plot_row"]


class _Cell(NamedTuple):
    name: str
    text: str


def plot_header(value: object, *, strings: bool = True, arrays: bool = True) -> str:
    """Return the header line, with the column names for messages like ``value``."""
    return "%time," + ",".join(cell.name for cell in _cells("field", value, strings, arrays, 0))


def plot_row(
    value: object, nanoseconds: int, *, strings: bool = True, arrays: bool = True, origin: int = 0
) -> str:
    """Return the line of values for a message, starting with its time.

    ``origin`` (nanoseconds) is subtracted from the line's times.
    """
    return f"{nanoseconds}," + ",".join(cell.text for cell in _cells("field", value, strings, arrays, origin))


def _cells(name: str, value: object, strings: bool, arrays: bool, origin: int) -> Iterator[_Cell]:
    # Use plain ``if`` statements, most frequent case first, because this runs for every value of every message.
    if isinstance(value, bool):
        yield _Cell(name, str(int(value)))
    elif isinstance(value, int | float):
        yield _Cell(name, str(value))
    elif isinstance(value, str):
        yield _Cell(name, value)
    elif value is None:
        # An element that does not have the rest of a path such as points[:]/x[0] keeps its column, which stays empty.
        yield _Cell(name, "")
    elif hasattr(value, "to_nsec"):
        # Subtract the origin only from points in time, not from durations.
        yield _Cell(name, str(value.to_nsec() - (origin if hasattr(value, "to_time") else 0)))
    elif isinstance(value, list | tuple):
        for index, element in enumerate(value):
            yield from _cells(f"{name}{index}", element, strings, arrays, origin)
    else:
        for field in getattr(value, "__slots__", ()):
            inner = getattr(value, field)
            # As in ROS, omit fields that are messages, unless the path itself selects them.
            if (strings and arrays) or not _is_left_out(inner, strings, arrays):
                yield from _cells(f"{name}.{field}", inner, strings, arrays, origin)


def _is_left_out(value: object, strings: bool, arrays: bool) -> bool:
    if isinstance(value, list | tuple):
        return not arrays or (not strings and bool(value) and isinstance(value[0], str))
    return not strings and isinstance(value, str)
