"""Reorders the bytes of ROS 1 messages whose fields are in a different order than in ROS 2. Pure.

ROS 1 messages have no padding, so a field's bytes do not depend on its position. The generated functions of
:mod:`minirospy.core.idl.cdr` then convert a message whose fields are in ROS 2's order.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from minirospy.base.errors import DeserializationError

__all__ = ["Array", "Fixed", "Node", "Reordered", "Text", "inverse", "reorder"]

_COUNT = struct.Struct("<I")
# number of zero-size elements allowed, in addition to one per byte of the message, as in core/idl/cdr.py
_SPARE = 10_000


@dataclass(frozen=True)
class Fixed:
    """A field that always takes ``size`` bytes."""

    size: int


@dataclass(frozen=True)
class Text:
    """A string."""


@dataclass(frozen=True)
class Array:
    """An array of elements; ``length`` is None if it is variable."""

    element: Node
    length: int | None = None


@dataclass(frozen=True)
class Reordered:
    """A message with reordered fields: ``fields`` are in input order, ``order`` lists their indices in output order."""

    fields: tuple[Node, ...]
    order: tuple[int, ...]


Node: TypeAlias = Fixed | Text | Array | Reordered


def inverse(node: Node) -> Node:
    """Return the node that undoes the reordering of ``node``."""
    if isinstance(node, Array):
        return Array(inverse(node.element), node.length)
    if isinstance(node, Reordered):
        fields = tuple(inverse(node.fields[number]) for number in node.order)
        return Reordered(fields, tuple(node.order.index(number) for number in range(len(node.order))))
    return node


def reorder(node: Node, data: bytes | memoryview) -> bytes:
    """Reorder the fields of a message. Raise DeserializationError if it is too short."""
    view = memoryview(data)
    parts: list[bytes | memoryview] = []
    try:
        end = _write(node, view, 0, parts)
    except struct.error as error:
        raise DeserializationError("the message ends too early") from error
    parts.append(view[end:])  # keep trailing data, so that the conversion rejects it
    return b"".join(parts)


def _write(node: Node, data: memoryview, start: int, parts: list[bytes | memoryview]) -> int:
    """Append the reordered bytes of the node at offset ``start`` to ``parts``; return the node's end offset."""
    if isinstance(node, Array) and not isinstance(node.element, Fixed):
        count, end = _count(node, data, start)
        parts.append(data[start:end])
        for _ in range(count):
            end = _write(node.element, data, end, parts)
        return end
    if isinstance(node, Reordered):
        return _write_fields(node, data, start, parts)
    if isinstance(node, Fixed):
        end = start + node.size
    elif isinstance(node, Array):
        assert isinstance(node.element, Fixed)
        count, end = _count(node, data, start)
        end += count * node.element.size
    else:
        (size,) = _COUNT.unpack_from(data, start)
        end = start + 4 + size
    if end > len(data):
        raise DeserializationError("the message ends too early")
    parts.append(data[start:end])
    return end


def _write_fields(node: Reordered, data: memoryview, start: int, parts: list[bytes | memoryview]) -> int:
    written: list[Sequence[bytes | memoryview]] = []
    end = start
    for field in node.fields:
        pieces: list[bytes | memoryview] = []
        end = _write(field, data, end, pieces)
        written.append(pieces)
    for number in node.order:
        parts += written[number]
    return end


def _count(node: Array, data: memoryview, start: int) -> tuple[int, int]:
    """Return the number of an array's elements, and the offset of the first one."""
    if node.length is not None:
        return node.length, start
    (count,) = _COUNT.unpack_from(data, start)
    if count > len(data) - start + _SPARE:
        raise DeserializationError("a length is longer than the message")
    return count, start + 4
