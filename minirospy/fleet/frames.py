"""Adds a robot's prefix to the frame ids in serialized messages (``robot1/base_link``), or removes it. Pure.

Frame ids are the ``frame_id`` of each std_msgs/Header, and each string field ``child_frame_id``. The bytes after the last
frame id are copied unchanged, so that an image costs one copy.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import NamedTuple

from minirospy.base.errors import DeserializationError
from minirospy.core.idl.digest import Lookup
from minirospy.core.idl.spec import PRIMITIVES, Field, MessageSpec

__all__ = ["FrameRewriter", "prefixed", "stripped"]

_LENGTH = struct.Struct("<I")
_MAX_ELEMENTS = 1_000_000


class _Skip(NamedTuple):
    """A run of ``size`` bytes that contains no frame id and is skipped."""

    size: int


class _Text(NamedTuple):
    """A string field; ``is_frame`` is True if it is a frame id."""

    is_frame: bool


class _Array(NamedTuple):
    """An array. ``steps`` describes one element; ``length`` is None for an array of variable length."""

    length: int | None
    steps: tuple[_Step, ...]


_Step = _Skip | _Text | _Array


class FrameRewriter:
    """Rewrites the frame ids in messages of one type."""

    def __init__(self, spec: MessageSpec, lookup: Lookup) -> None:
        """Create a rewriter for a type. Raise DefinitionError if the spec is invalid. Exceptions from ``lookup`` propagate."""
        self._steps = _trimmed(_steps(spec, lookup))

    @property
    def has_frames(self) -> bool:
        """Return whether messages of the type contain frame ids."""
        return bool(self._steps)

    def rewritten(self, data: bytes | memoryview, change: Callable[[bytes], bytes]) -> bytes:
        """Return the message with ``change`` applied to each frame id. Raise DeserializationError if the message is too short."""
        data = bytes(data)
        if not self._steps:
            return data
        pieces: list[bytes] = []
        try:
            copied, _ = _run(self._steps, data, 0, 0, change, pieces)
        except (struct.error, OverflowError) as error:  # OverflowError: the offset exceeds 32 bits
            raise DeserializationError("the message ends too early") from error
        pieces.append(data[copied:])
        return b"".join(pieces)


def prefixed(prefix: str) -> Callable[[bytes], bytes]:
    """Return a function that changes ``base_link`` to ``robot1/base_link``. It adds no prefix to empty or prefixed ids."""
    start = prefix.encode() + b"/"

    def change(frame: bytes) -> bytes:
        bare = frame.lstrip(b"/")
        return bare if not bare or bare.startswith(start) else start + bare

    return change


def stripped(prefix: str) -> Callable[[bytes], bytes]:
    """Return a function that changes ``robot1/base_link`` to ``base_link``; other ids stay unchanged."""
    start = prefix.encode() + b"/"

    def change(frame: bytes) -> bytes:
        bare = frame.lstrip(b"/")
        return bare[len(start) :] if bare.startswith(start) else frame

    return change


def _steps(spec: MessageSpec, lookup: Lookup) -> tuple[_Step, ...]:
    found: list[_Step] = []
    for field in spec.fields:
        found += _field_steps(field, spec.full_name, lookup)
    return _joined(found)


def _field_steps(field: Field, owner: str, lookup: Lookup) -> tuple[_Step, ...]:
    type_ = field.type
    one: tuple[_Step, ...]
    if not type_.is_primitive:
        one = _steps(lookup(type_.base), lookup)
    elif type_.base == "string":
        is_frame = field.name == "child_frame_id" or (owner == "std_msgs/Header" and field.name == "frame_id")
        one = (_Text(is_frame),)
    else:
        one = (_Skip(struct.calcsize("<" + PRIMITIVES[type_.base])),)
    if not type_.is_array:
        return one
    match one:
        case (_Skip(size),) if type_.length is not None:
            return (_Skip(size * type_.length),)
    return (_Array(type_.length, one),)


def _joined(steps: list[_Step]) -> tuple[_Step, ...]:
    joined: list[_Step] = []
    for step in steps:
        last = joined[-1] if joined else None
        if isinstance(step, _Skip) and isinstance(last, _Skip):
            joined[-1] = _Skip(last.size + step.size)
        else:
            joined.append(step)
    return tuple(joined)


def _has_frame(step: _Step) -> bool:
    if isinstance(step, _Array):
        return any(map(_has_frame, step.steps))
    return isinstance(step, _Text) and step.is_frame


def _trimmed(steps: tuple[_Step, ...]) -> tuple[_Step, ...]:
    """Return the steps up to the last frame id, after which a message is copied unchanged."""
    last = max((number for number, step in enumerate(steps) if _has_frame(step)), default=-1)
    return steps[: last + 1]


def _run(
    steps: tuple[_Step, ...],
    data: bytes,
    copied: int,
    at: int,
    change: Callable[[bytes], bytes],
    pieces: list[bytes],
) -> tuple[int, int]:
    """Rewrite ``data`` from offset ``at`` on, into ``pieces``. Return the offsets up to which it was copied and parsed."""
    for step in steps:
        if isinstance(step, _Skip):
            at += step.size
        elif isinstance(step, _Text):
            (size,) = _LENGTH.unpack_from(data, at)
            start, at = at, at + 4 + size
            if step.is_frame and at <= len(data):
                new = change(data[start + 4 : at])
                pieces += [data[copied:start], _LENGTH.pack(len(new)), new]
                copied = at
        else:
            count = step.length
            if count is None:
                (count,) = _LENGTH.unpack_from(data, at)
                at += 4
            match step.steps:
                case (_Skip(size),):
                    at += size * count
                case ():
                    pass
                case inner:
                    # Each element has at least four bytes, because it starts with a four-byte length.
                    if count * 4 > len(data) - at or count > _MAX_ELEMENTS:
                        raise DeserializationError(f"an array of {count} elements is longer than the message")
                    for _ in range(count):
                        copied, at = _run(inner, data, copied, at, change, pieces)
        if at > len(data):
            raise DeserializationError("the message ends too early")
    return copied, at
