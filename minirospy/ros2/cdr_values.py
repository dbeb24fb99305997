"""Encodes and decodes CDR for the ROS 2 messages that the bridge itself uses, given their types' fields. Pure.

Messages that are only forwarded are converted by ``core/idl/cdr.py``, which is faster. Numbers become int, float or bool;
byte arrays become bytes, other arrays lists, and messages dicts.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Mapping, Sized
from typing import cast

from minirospy.base.errors import DeserializationError
from minirospy.core.idl.cdr import CDR_HEADER
from minirospy.core.idl.type_hash import Fields

__all__ = ["decode", "encode"]

_LETTERS = {
    "bool": "?", "boolean": "?", "byte": "B", "octet": "B", "uint8": "B", "char": "B", "int8": "b", "int16": "h", "uint16": "H",
    "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float": "f", "float32": "f", "double": "d", "float64": "d",
}  # fmt: skip
_DUMMY: Fields = {"structure_needs_at_least_one_member": "uint8"}
_HEADER = len(CDR_HEADER)


def decode(name: str, fields: Callable[[str], Fields], data: bytes) -> dict[str, object]:
    """Decode a message of type ``name``. ``fields(type)`` returns the fields of a type.

    Raise DeserializationError if the data is invalid.
    """
    if len(data) < _HEADER or data[:2] not in (b"\0\0", b"\0\1"):
        raise DeserializationError("this is not plain CDR of version 1")
    return _Reader(data, fields).message(name)


def encode(name: str, fields: Callable[[str], Fields], values: Mapping[str, object]) -> bytes:
    """Encode a message of type ``name``. Fields that are missing in ``values`` become zero or empty."""
    writer = _Writer(fields)
    writer.message(name, values)
    return CDR_HEADER + bytes(writer.data)


def _shape(text: str) -> tuple[str, bool, int | None]:
    """Parse a field's type: return the element type, whether it is an array, and the length if that is fixed."""
    if text.startswith("sequence<"):
        return text[len("sequence<") : -1].partition(",")[0], True, None
    base, bracket, length = text.partition("[")
    return base, bool(bracket), int(length[:-1]) if bracket else None


class _Reader:
    def __init__(self, data: bytes, fields: Callable[[str], Fields]) -> None:
        self._data = data[_HEADER:]
        self._order = "<" if data[1] else ">"
        self._fields = fields
        self._at = 0

    def message(self, name: str) -> dict[str, object]:
        return {field: self._value(text) for field, text in (self._fields(name) or _DUMMY).items()}

    def _value(self, text: str) -> object:
        base, is_array, count = _shape(text)
        if not is_array:
            return self._numbers(_LETTERS[base], 1)[0] if base in _LETTERS else self._one(base)
        if count is None:
            count = self._length()
        if count > len(self._data) - self._at:
            # Each element takes at least one byte, so the message is too short for this number of elements.
            raise DeserializationError("the message ends too early")
        if base not in _LETTERS:
            return [self._one(base) for _ in range(count)]
        letter = _LETTERS[base]
        return self._bytes(count) if letter == "B" else list(self._numbers(letter, count))

    def _one(self, base: str) -> object:
        if base != "string":
            return self.message(base)
        return self._bytes(self._length()).removesuffix(b"\0").decode("utf-8", "surrogateescape")

    def _length(self) -> int:
        (count,) = self._numbers("I", 1)
        return cast("int", count)

    def _numbers(self, letter: str, count: int) -> tuple[object, ...]:
        if not count:
            return ()
        width = struct.calcsize(f"<{letter}")
        self._at += -self._at % width
        return struct.unpack(f"{self._order}{count}{letter}", self._bytes(count * width))

    def _bytes(self, count: int) -> bytes:
        start, self._at = self._at, self._at + count
        if self._at > len(self._data):
            raise DeserializationError("the message ends too early")
        return self._data[start : self._at]


class _Writer:
    def __init__(self, fields: Callable[[str], Fields]) -> None:
        self.data = bytearray()
        self._fields = fields

    def message(self, name: str, values: Mapping[str, object]) -> None:
        for field, text in (self._fields(name) or _DUMMY).items():
            self._value(text, values.get(field))

    def _value(self, text: str, value: object) -> None:
        base, is_array, count = _shape(text)
        if not is_array:
            self._elements(base, [value])
            return
        elements = cast("Iterable[object]", [None] * (count or 0) if value is None else value)
        if count is None:
            self._elements("uint32", [len(cast("Sized", elements))])
        self._elements(base, elements)

    def _elements(self, base: str, elements: Iterable[object]) -> None:
        if base not in _LETTERS:
            for each in elements:
                self._one(base, each)
        elif isinstance(elements, bytes):
            self.data += elements
        else:
            letter = _LETTERS[base]
            numbers = [each or 0 for each in elements]
            if numbers:
                self.data += bytes(-len(self.data) % struct.calcsize(f"<{letter}"))
                self.data += struct.pack(f"<{len(numbers)}{letter}", *numbers)

    def _one(self, base: str, value: object) -> None:
        if base != "string":
            self.message(base, cast("Mapping[str, object]", value or {}))
            return
        data = cast("str", value or "").encode("utf-8", "surrogateescape") + b"\0"
        self._elements("uint32", [len(data)])
        self.data += data
