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
    """Return the header line: the column names for messages with the same fields as ``value``."""
    return "%time," + ",".join(cell.name for cell in _cells("field", value, strings, arrays, 0))


def plot_row(
    value: object, nanoseconds: int, *, strings: bool = True, arrays: bool = True, origin: int = 0
) -> str:
    """Return the line for a message: its time, then its values.

    ``origin`` (nanoseconds) is subtracted from the line's times.
    """
    return f"{nanoseconds}," + ",".join(cell.text for cell in _cells("field", value, strings, arrays, origin))


def _cells(name: str, value: object, strings: bool, arrays: bool, origin: int) -> Iterator[_Cell]:
    # Use plain ``if`` statements, most frequent case first, because this code runs for every value of every message.
    if isinstance(value, bool):
        yield _Cell(name, str(int(value)))
    elif isinstance(value, int | float):
        yield _Cell(name, str(value))
    elif isinstance(value, str):
        yield _Cell(name, value)
    elif value is None:
        # For a path such as points[:]/x[0], an element without x[0] keeps its column, which stays empty.
        yield _Cell(name, "")
    elif hasattr(value, "to_nsec"):
        # Subtract the origin from times, but not from durations.
        yield _Cell(name, str(value.to_nsec() - (origin if hasattr(value, "to_time") else 0)))
    elif isinstance(value, list | tuple):
        for index, element in enumerate(value):
            yield from _cells(f"{name}{index}", element, strings, arrays, origin)
    else:
        for field in getattr(value, "__slots__", ()):
            inner = getattr(value, field)
            # As in ROS, omit fields that are messages, unless the path selects them directly.
            if (strings and arrays) or not _is_left_out(inner, strings, arrays):
                yield from _cells(f"{name}.{field}", inner, strings, arrays, origin)


def _is_left_out(value: object, strings: bool, arrays: bool) -> bool:
    if isinstance(value, list | tuple):
        return not arrays or (not strings and bool(value) and isinstance(value[0], str))
    return not strings and isinstance(value, str)
