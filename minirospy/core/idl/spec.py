"""The spec tree: the contents of a .msg, .srv or .action text."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["PRIMITIVES", "ActionSpec", "Constant", "Field", "FieldType", "MessageSpec", "ServiceSpec"]

PRIMITIVES = {
    "bool": "B",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
    "byte": "b",
    "char": "B",
    "time": "II",
    "duration": "ii",
    "string": "",
}
"""Dict from primitive type to its format characters for ``struct``. Strings have none."""


class FieldType(NamedTuple):
    """A field's type: a primitive or ``pkg/Name``; for an array of variable length, ``length`` is None."""

    base: str
    is_array: bool = False
    length: int | None = None

    def __str__(self) -> str:
        if not self.is_array:
            return self.base
        return f"{self.base}[{'' if self.length is None else self.length}]"

    @property
    def is_primitive(self) -> bool:
        """Return whether the base is one of PRIMITIVES."""
        return self.base in PRIMITIVES

    @property
    def is_bytes(self) -> bool:
        """Return whether Python represents the field as bytes."""
        return self.is_array and self.base in ("uint8", "char")


class Field(NamedTuple):
    """A field, with its name as in the definition."""

    name: str
    type: FieldType


class Constant(NamedTuple):
    """A constant: its value, and its text in the definition, which is part of the md5sum."""

    name: str
    type: str
    value: bool | int | float | str
    text: str


class MessageSpec(NamedTuple):
    """A message definition."""

    package: str
    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...]
    text: str

    @property
    def full_name(self) -> str:
        """The full name ``pkg/Name``."""
        return f"{self.package}/{self.name}"

    @property
    def has_header(self) -> bool:
        """Return whether the message starts with a header that publishers fill in."""
        return bool(self.fields) and self.fields[0] == Field("header", FieldType("std_msgs/Header"))


class ServiceSpec(NamedTuple):
    """A service definition."""

    package: str
    name: str
    request: MessageSpec
    response: MessageSpec
    text: str

    @property
    def full_name(self) -> str:
        """The full name ``pkg/Name``."""
        return f"{self.package}/{self.name}"


class ActionSpec(NamedTuple):
    """An action definition: its seven messages (http://wiki.ros.org/actionlib)."""

    package: str
    name: str
    messages: tuple[MessageSpec, ...]
    text: str
