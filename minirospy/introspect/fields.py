"""Parse and follow paths to fields of messages: ``pose/position/x``, ``points[0]/x``, ``ranges[1:3]``, ``points[:]/x``.

Pure: :func:`parse_path` returns steps, which other functions apply to a message to get a value. Source:
http://wiki.ros.org/rostopic#rostopic_echo.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import NotFoundError, UsageError

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message

__all__ = ["NotAnArrayError", "Report", "Step", "field_type", "field_value", "parse_path"]

_STEP = re.compile(r"^(\w+)(?:\[(-?\d+|-?\d*(?::-?\d*){1,2})\])?$")


_TIMES = {
    "time": {"secs": "uint32", "nsecs": "uint32"},
    "duration": {"secs": "int32", "nsecs": "int32"},
}
"""The primitive types that have fields, each with its fields and their types."""


class Step(NamedTuple):
    """One step of a path: a field name and, for an array, an index or a slice."""

    name: str
    element: int | slice | None


class NotAnArrayError(NotFoundError):
    """Raised if a path indexes or slices a value that is neither an array nor a string. ``type_name`` is the value's class."""

    def __init__(self, name: str, value: object) -> None:
        super().__init__("array", name, hint=f"the field is a single {_type_of(value)}")
        self.type_name = type(value).__name__


def parse_path(path: str, *, zero_steps: bool = False) -> tuple[Step, ...]:
    """Parse a field path; the empty path means the whole message.

    Raise UsageError if its syntax is invalid or, unless ``zero_steps``, if a slice has a step of 0.
    """
    return tuple(_parse_step(part, path, zero_steps) for part in path.split("/")) if path else ()


Report = Callable[[NotFoundError | IndexError], object]
"""A function that receives the error for each element of a slice that does not have the rest of the path."""


def field_value(message: object, steps: tuple[Step, ...], report: Report | None = None) -> object:
    """Return the value at a path. For a slice of messages followed by a field name, return a list of that field's values.

    Strings have indices and slices, too. Raise NotFoundError if a field does not exist, IndexError if an array is too short.
    With ``report``, an element of a slice that lacks the rest of the path is None, and its error is reported.
    """
    value: object = message

    for at, (name, index) in enumerate(steps):
        if isinstance(value, list | tuple | bytes):
            raise _array_as_message(steps[at - 1].name, name)
        value = _attribute(value, name)
        if index is None:
            continue
        if not isinstance(value, list | tuple | bytes | str):
            raise NotAnArrayError(name, value)
        rest = steps[at + 1 :]
        if isinstance(index, slice) and rest and not isinstance(value, str | bytes):
            return [_element_value(element, rest, report) for element in value[index]]
        size = (
            f"string has {len(value)} characters"
            if isinstance(value, str)
            else f"array has {len(value)} elements"
        )
        try:
            value = value[index]
        except IndexError as error:
            raise IndexError(f"{name}[{index}]: the {size}") from error

    return value


def _element_value(element: object, rest: tuple[Step, ...], report: Report | None) -> object:
    if report is None:
        return field_value(element, rest)
    try:
        return field_value(element, rest, report)
    except (NotFoundError, IndexError) as error:
        report(error)
        return None


def field_type(message_class: type[Message], path: str) -> str:
    """Return the ROS type of the field at ``path`` in a message class.

    Raise NotFoundError if the field does not exist or the class of an inner message is not installed.
    """
    from minirospy.core.idl.load import message_class as load_class

    type_: str = message_class._type
    before = Step("", None)
    for at, step in enumerate(parse_path(path)):
        name, index = step
        if type_.endswith("]") and before.element is None:
            raise _array_as_message(before.name, name)
        before = step
        if type_ in _TIMES:
            if name not in _TIMES[type_]:
                raise NotFoundError("field", name, _TIMES[type_], f"[{type_}] has {' '.join(_TIMES[type_])}")
            type_ = _TIMES[type_][name]
            continue
        if at:
            message_class = load_class(type_.partition("[")[0])
        if name not in message_class.__slots__:
            raise _no_field(message_class, name)
        type_ = message_class._slot_types[list(message_class.__slots__).index(name)]
        if isinstance(index, int):
            type_ = type_.partition("[")[0]
    return type_


def _parse_step(part: str, path: str, zero_steps: bool) -> Step:
    match = _STEP.match(part)
    if not match:
        raise UsageError(
            f"field path [{path}]: [{part}] is not one of field, field[0], field[1:3], field[::2]"
        )
    name, index = match.groups()
    if index is None:
        return Step(name, None)
    numbers = [int(number) if number else None for number in index.split(":")]
    if numbers[2:] == [0] and not zero_steps:
        raise UsageError(f"field path [{path}]: [{part}] has a step of 0")
    return Step(name, slice(*numbers) if ":" in index else numbers[0])


def _attribute(value: object, name: str) -> object:
    try:
        return getattr(value, name)
    except AttributeError:
        raise _no_field(type(value), name) from None


def _array_as_message(array: str, name: str) -> NotFoundError:
    hint = f"[{array}] is an array: {array}[0]/{name} is that of its first element, {array}[:]/{name} of all"
    return NotFoundError("field", name, hint=hint)


def _no_field(message_class: type[object], name: str) -> NotFoundError:
    fields = list(getattr(message_class, "__slots__", ()))
    hint = f"[{_type_of(message_class)}] has {' '.join(fields) or 'no fields'}"
    return NotFoundError("field", name, fields, hint)


def _type_of(value: object) -> str:
    return str(getattr(value, "_type", None) or type(value).__name__)
