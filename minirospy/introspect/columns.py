"""Arrange the fields of messages of one type in columns. Pure.

A column is named by the path of its field, such as ``pose.pose.position.x``. If the values of an array correspond to the names in
a field ``name``, as in sensor_msgs/JointState, each name has a column: ``position[elbow]``. In messages with a different number
of names and values, the whole array is in the column of its field, ``position``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import Enum
from operator import attrgetter
from typing import Any, NamedTuple

from minirospy.base.errors import BagError

__all__ = ["MAX_COLUMNS", "Column", "Kind", "columns", "leaves"]

MAX_COLUMNS = 20_000  # maximum number of columns per table; a laser scan has about 3,000
_NUMBERS = {
    *("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"),
    *("float32", "float64", "bool", "char", "byte"),
}
_NO_BYTES = {"uint8", "char"}  # arrays of these types are bytes objects in Python, not lists of numbers


class Kind(Enum):
    """The kind of values in a column."""

    PLAIN = "plain"  # numbers, strings, bytes or lists, unchanged from the message
    TIME = "time"  # nanoseconds since 1970
    DURATION = "duration"  # nanoseconds


class Column(NamedTuple):
    """A column: its name, its kind, and one value per message (None if the message has none)."""

    name: str
    kind: Kind
    values: list[Any]


class _Leaf(NamedTuple):
    path: str
    type: str


def leaves(message_class: Any, prefix: str = "") -> Iterator[_Leaf]:
    """Yield the path and type of each field. Descend into messages, but yield an array of messages as a single field."""
    for name, type_ in zip(message_class.__slots__, message_class._slot_types, strict=True):
        path = f"{prefix}{name}"
        nested = None if type_.endswith("]") else _class_of(message_class, name, type_)
        if nested is None:
            yield _Leaf(path, type_)
        else:
            yield from leaves(nested, f"{path}.")


def _class_of(message_class: Any, name: str, type_: str) -> Any:
    """Return the message class of a field, or None if the field has a primitive type."""
    if type_ in ("time", "duration", "string") or type_ in _NUMBERS:
        return None
    return type(getattr(message_class(), name))


def columns(messages: Sequence[object]) -> list[Column]:
    """Return the columns for messages of the same type, or no columns if there are no messages.

    Raise BagError if the values of an array have more than MAX_COLUMNS names.
    """
    if not messages:
        return []
    fields = list(leaves(type(messages[0])))
    if not fields:
        return []
    get = attrgetter(*(field.path for field in fields))
    rows = map(get, messages) if len(fields) > 1 else ((get(message),) for message in messages)
    by_path = dict(zip((field.path for field in fields), map(list, zip(*rows, strict=True)), strict=True))

    found: list[Column] = []
    lists_of_names = {field.path for field in fields if field.type.startswith("string[")}
    for field in fields:
        values = by_path[field.path]
        names = by_path[path] if (path := _names_of(field)) in lists_of_names else []
        if field.type in ("time", "duration"):
            kind = Kind.TIME if field.type == "time" else Kind.DURATION
            found.append(Column(field.path, kind, [value.to_nsec() for value in values]))
        elif names and any(belong := _belong(names, values)):
            named = [each if fits else () for each, fits in zip(values, belong, strict=True)]
            found += _named(field.path, names, named)
            whole = [
                None if fits or not len(each) else each for each, fits in zip(values, belong, strict=True)
            ]
            if any(each is not None for each in whole):
                found.append(Column(field.path, Kind.PLAIN, whole))
        else:
            found.append(Column(field.path, Kind.PLAIN, values))
    return found


def _names_of(field: _Leaf) -> str:
    """For an array of numbers, return the path of the ``name`` field in the same message. For any other field, return ""."""
    element, bracket, _ = field.type.partition("[")
    if not bracket or element not in _NUMBERS - _NO_BYTES:
        return ""
    base, dot, _ = field.path.rpartition(".")
    return f"{base}{dot}name"


def _belong(names: Sequence[Sequence[object]], values: Sequence[Sequence[object]]) -> list[bool]:
    """For each array, return whether it is not empty and has the same length as its message's list of names."""
    return [0 < len(array) == len(own) for own, array in zip(names, values, strict=True)]


def _named(path: str, names: Sequence[Sequence[str]], values: Sequence[Sequence[object]]) -> Iterator[Column]:
    known = list(dict.fromkeys(name for own in names for name in own))
    if len(known) > MAX_COLUMNS:
        raise BagError(f"{path} has values for more than {MAX_COLUMNS:,} names: too many columns for a table")
    found: dict[str, list[object]] = {name: [None] * len(values) for name in known}
    for row, (own, array) in enumerate(zip(names, values, strict=True)):
        for name, value in zip(own, array, strict=False):
            found[name][row] = value
    for name, each in found.items():
        yield Column(f"{path}[{name}]", Kind.PLAIN, each)
