"""rostopic's functions that format messages as comma-separated values and parse field paths.

Source: the output of ROS's `rostopic._str_plot`. Each string is a cell; byte arrays and empty arrays are omitted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from minirospy.base.times import Time, TVal

__all__ = [
    "array_index_or_slice",
    "ascii_table",
    "convert_getattr",
    "is_string_type",
    "nested_attribute",
    "plot",
    "plot_cells",
    "plot_field_cells",
    "plot_fields",
]

FieldFilter = Callable[[Any], Iterable[str]]
_PLAIN = (bool, int, float)


def plot_fields(val: object, f: str, field_filter: FieldFilter | None) -> str:
    """Return the CSV header line for a value: `time,`, then the path of each cell, starting with ``f``."""
    return f"time,{plot_field_cells(val, f, field_filter) or ''}"


def plot_field_cells(val: object, f: str, field_filter: FieldFilter | None) -> str | None:
    """Return the names of a value's CSV columns, or None if it has none."""
    return _joined(name for name, _ in _cells(val, f, None, field_filter))


def plot(
    val: Any,
    time_offset: Time | None = None,
    current_time: Time | None = None,
    field_filter: FieldFilter | None = None,
    type_information: object = None,
    fixed_numeric_width: int | None = None,
    value_transform: object = None,
) -> str:
    """Return a value's CSV line: the time in nanoseconds, then its cells.

    The time is ``current_time``, else that of the message's header, else ROS's current time, minus ``time_offset``.
    ``type_information``, ``fixed_numeric_width`` and ``value_transform`` have no effect, as in ROS.
    """
    origin = 0 if time_offset is None else time_offset.to_nsec()
    cells = plot_cells(val, time_offset, field_filter) or ""
    if current_time is not None:
        now = current_time
    elif getattr(val, "_has_header", False):
        now = val.header.stamp
    else:
        from minirospy.client import get_rostime

        now = get_rostime()
    return f"{now.to_nsec() - origin},{cells}"


def plot_cells(val: object, time_offset: Time | None, field_filter: FieldFilter | None) -> str | None:
    """Return a value's CSV cells, or None if it cannot be printed as CSV."""
    return _joined(text for _, text in _cells(val, "", time_offset, field_filter))


def _joined(texts: Iterator[str]) -> str | None:
    found = list(texts)
    return ",".join(found) if found else None


def _cells(
    value: Any, path: str, time_offset: Time | None, field_filter: FieldFilter | None
) -> Iterator[tuple[str, str]]:
    """Yield (path, text) for each CSV cell."""
    if type(value) in (*_PLAIN, str) or isinstance(value, TVal):
        yield path, _text(value, time_offset)
    elif hasattr(value, "_slot_types"):
        chosen = value.__slots__ if field_filter is None else list(field_filter(value))
        for name, type_ in zip(value.__slots__, value._slot_types, strict=False):
            if name in chosen:
                field = convert_getattr(value, name, type_)
                yield from _cells(field, f"{path}.{name}", time_offset, field_filter)
    elif type(value) in (list, tuple) and len(value):
        # As in ROS, the first element's type decides: a list of lists has no cells.
        first = value[0]
        if type(first) in (*_PLAIN, str) or isinstance(first, TVal):
            for index, each in enumerate(value):
                yield f"{path}{index}", _text(each, None)
        elif hasattr(first, "_slot_types"):
            for index, each in enumerate(value):
                yield from _cells(each, f"{path}{index}", time_offset, field_filter)


def _text(value: Any, time_offset: Time | None) -> str:
    if type(value) is bool:
        return str(int(value))
    return str(value - time_offset) if time_offset is not None and isinstance(value, Time) else str(value)


def convert_getattr(val: object, f: str, t: str) -> Any:
    """Return a field's value; convert a string in a uint8[] field to a list of numbers."""
    value = getattr(val, f)
    return [ord(each) for each in value] if isinstance(value, str) and "uint8[" in t else value


def is_string_type(t: object) -> bool:
    """Return whether ``t`` is the string type."""
    return t is str


def nested_attribute(msg: object, nested_attributes: str) -> Any:
    """Return the attribute at a path such as `header/stamp`. Raise AttributeError if it does not exist."""
    value: Any = msg
    for name in nested_attributes.split("/"):
        value = getattr(value, name)
    return value


def array_index_or_slice(index_string: str) -> int | slice:
    """Return the index or slice in a path's brackets, such as `1:3`. Raise AssertionError if they are invalid."""
    if not index_string:
        raise AssertionError("empty array index")
    words = index_string.split(":")
    roles = ("slice start", "slice stop", "slice step")

    def number(word: str, role: str) -> int:
        try:
            return int(word)
        except ValueError:
            raise AssertionError(f"non-integer {role} '{word}'") from None

    if len(words) == 1:
        return number(words[0], "array index step")
    numbers = [number(word, role) if word else None for word, role in zip(words, roles, strict=False)]
    if len(words) > 3:
        raise AssertionError("too many slice arguments")
    return slice(*numbers)


def ascii_table(header: Sequence[str], cols: Mapping[str, list[Any]]) -> str:
    """Return a table with a line below the header row. As in ROS, pad the columns in ``cols`` in place."""
    widths = {name: max(len(name), *(len(each) for each in cols[name])) for name in header}
    for name in header:
        cols[name][:] = [str(each).ljust(widths[name]) for each in cols[name]]
    rows = ["   ".join(row) for row in zip(*(cols[name] for name in header), strict=False)]
    titles = "   ".join(name.center(widths[name]) for name in header)
    rule = "=" * (sum(widths.values()) + 3 * (len(header) - 1))
    return "\n".join([titles, rule, *rows, ""])
