"""The fields of message types, as rosapi's TypeDef describes them. Pure.

Source: http://wiki.ros.org/rosapi (message_details, service_request_details, service_response_details).
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from minirospy.core.idl.protocols import Message

__all__ = ["TypeDefinition", "describe"]

_ARRAY = re.compile(r"(.*)\[(\d*)\]\Z")
_TIMES = ("time", "duration")
_ATOMS = (
    *("bool", "byte", "char", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"),
    *("float32", "float64", "string"),
)
_NOT_AN_ARRAY = -1


@dataclass
class TypeDefinition:
    """The fields and constants of a type.

    In ``lengths``, -1 means that a field is not an array, and 0 means an array of any length.
    """

    type: str
    names: list[str] = field(default_factory=list)
    types: list[str] = field(default_factory=list)
    lengths: list[int] = field(default_factory=list)
    examples: list[str] = field(default_factory=list)
    constants: list[tuple[str, str]] = field(default_factory=list)


def describe(class_: type[Message], find: Callable[[str], type[Message]]) -> list[TypeDefinition]:
    """Describe a type and, once each, the types that it uses. ``find`` maps a type's name to its class."""
    return list(_walk(_described(class_), find, {_name_of(class_)}))


def _walk(
    found: TypeDefinition, find: Callable[[str], type[Message]], seen: set[str]
) -> Iterator[TypeDefinition]:
    yield found
    for type_ in found.types:
        if type_ in seen or type_ in _ATOMS:
            continue
        seen.add(type_)
        if type_ in _TIMES:
            yield TypeDefinition(type_, ["secs", "nsecs"], ["int32"] * 2, [_NOT_AN_ARRAY] * 2, ["0"] * 2)
        else:
            yield from _walk(_described(find(type_)), find, seen)


def _described(class_: type[Message]) -> TypeDefinition:
    instance = class_()
    found = TypeDefinition(_name_of(class_))
    for name, type_ in zip(instance.__slots__, instance._slot_types, strict=True):
        array = _ARRAY.match(type_)
        element = array[1] if array else type_
        found.names.append(name)
        found.types.append(element)
        found.lengths.append(int(array[2] or 0) if array else _NOT_AN_ARRAY)
        found.examples.append("[]" if array else str(getattr(instance, name)) if element in _ATOMS else "{}")

    for name, value in inspect.getmembers(class_):
        if name not in instance.__slots__ and not name.startswith("_") and not inspect.isroutine(value):
            found.constants.append((name, str(value)))
    return found


def _name_of(class_: type[Message]) -> str:
    return class_._type
