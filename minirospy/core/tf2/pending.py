"""Store TFMessages as received, and decode a frame's samples when that frame is looked up.

A publisher sends the same frames in the same order again and again: two messages with the same layout differ only in
sequence numbers, stamps and transforms, which are at the same offsets. Therefore a message with a known layout is
recognized without decoding it, and stored as bytes. Messages are dropped without decoding if the caches would have dropped
their samples by now.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from typing import NamedTuple

from minirospy.base.errors import DeserializationError
from minirospy.core.tf2.rotation import Quaternion, Vector

__all__ = ["Arrival", "Layout", "Layouts", "TransformSample", "read_transforms", "without_slash"]

_COUNT = struct.Struct("<I")
_HEAD = struct.Struct("<4I")
_STAMP = struct.Struct("<2I")
_BODY = struct.Struct("<7d")
_BLOCK = 64  # number of messages in a block; expired messages are dropped in whole blocks
MAX_MESSAGES = 16_384
_MAX_LAYOUTS = 16_384
_MAX_SAME_LENGTH = 8


class TransformSample(NamedTuple):
    """One transform in a message. The stamp is in nanoseconds."""

    parent: str
    child: str
    stamp: int
    translation: Vector
    rotation: Quaternion


class Arrival(NamedTuple):
    """A stored message: its number in the order of arrival, its sender, and its bytes."""

    number: int
    authority: str
    data: bytes


class _Offsets(NamedTuple):
    """The location of a transform in a message: the offsets of its header, and of its seven numbers."""

    parent: str
    child: str
    header: int
    body: int


def read_transforms(data: bytes) -> list[TransformSample]:
    """Parse the transforms in a serialized tf2_msgs/TFMessage, or tf/tfMessage, which has the same format.

    Raise DeserializationError if the bytes are not a TFMessage.
    """
    return [_sample(data, offsets) for offsets in _find_transforms(data)]


class Layout:
    """The layout of all messages with the same frames in the same order, and the stored messages with this layout."""

    def __init__(self, found: list[_Offsets]) -> None:
        self._offsets = found
        self._index = {offsets.child: index for index, offsets in enumerate(found)}
        self._arrivals: list[Arrival] = []
        self._dropped = 0  # number of messages dropped from the start of the list
        # Per transform: index of the next message to decode, counted from the first one ever received
        self._decoded = [0] * len(found)
        # Per transform: the newest stamp when expired messages were last dropped
        self._newest = [0] * len(found)

    @property
    def children(self) -> list[str]:
        """The child frames, in message order."""
        return [offsets.child for offsets in self._offsets]

    def keep(self, arrival: Arrival, span: int) -> list[str]:
        """Store a message and drop expired ones; return the frames to decode now, so that their messages can be dropped."""
        self._arrivals.append(arrival)
        return [] if len(self._arrivals) % _BLOCK else self._drop_expired(span)

    def take(self, child: str) -> Iterator[tuple[int, str, TransformSample]]:
        """Decode a frame's messages received since the last call: yield (arrival number, authority, sample)."""
        index = self._index[child]
        start = max(0, self._decoded[index] - self._dropped)
        self._decoded[index] = self._dropped + len(self._arrivals)
        offsets = self._offsets[index]
        for arrival in self._arrivals[start:]:
            yield arrival.number, arrival.authority, _sample(arrival.data, offsets)

    def forget(self) -> None:
        """Drop all messages."""
        self._dropped += len(self._arrivals)
        self._arrivals.clear()

    def _drop_expired(self, span: int) -> list[str]:
        """Drop the oldest blocks that no frame needs any more; return the frames to decode so that more can be dropped.

        A frame does not need messages that it has decoded, or whose samples its cache would have dropped. The cache drops
        samples that are too old compared with the newest message, if it accepts that message, whose transform must be
        valid and later than the previous ones. A frame whose newest message would be rejected must be decoded; then its
        messages can be dropped too.
        """
        newest = [_sample(self._arrivals[-1].data, offsets) for offsets in self._offsets]
        moves_on = [
            _is_valid(sample) and sample.stamp > before
            for sample, before in zip(newest, self._newest, strict=True)
        ]
        self._newest = [sample.stamp for sample in newest]

        count = 0
        while count + _BLOCK < len(self._arrivals):
            last = self._arrivals[count + _BLOCK - 1].data
            needed = self._dropped + count + _BLOCK
            if any(
                decoded < needed and (not moves or _stamp(last, offsets) >= sample.stamp - span)
                for decoded, moves, offsets, sample in zip(
                    self._decoded, moves_on, self._offsets, newest, strict=True
                )
            ):
                break
            count += _BLOCK
        del self._arrivals[:count]
        self._dropped += count

        is_full = len(self._arrivals) >= MAX_MESSAGES
        return [
            offsets.child
            for offsets, moves in zip(self._offsets, moves_on, strict=True)
            if is_full or not moves
        ]


class Layouts:
    """All known layouts. :meth:`find` looks one up by a message's bytes."""

    def __init__(self) -> None:
        # For messages with one transform: dict from the bytes that contain both frame names to the layout
        self._single: dict[bytes, Layout] = {}
        # Dict from message length to (mask of the constant bytes, their value, layout)
        self._several: dict[int, list[tuple[int, int, Layout]]] = {}
        self._count = 0

    def __iter__(self) -> Iterator[Layout]:
        yield from self._single.values()
        for found in self._several.values():
            for _, _, layout in found:
                yield layout

    def find(self, data: bytes) -> Layout | None:
        """Return a message's layout, or None if the layout is unknown or the message is invalid."""
        if data[:4] == b"\1\0\0\0":
            return self._single.get(data[16:-56])
        candidates = self._several.get(len(data))
        if candidates is None:
            return None
        number = int.from_bytes(data, "little")
        for mask, value, layout in candidates:
            if number & mask == value:
                return layout
        return None

    def add(self, data: bytes) -> Layout | None:
        """Add a layout for a message and return it.

        Return None if there are no frames, a duplicate frame, or too many layouts.
        """
        found = _find_transforms(data)
        children = {offsets.child for offsets in found}
        if not found or len(children) < len(found) or self._count >= _MAX_LAYOUTS:
            return None

        layout = Layout(found)
        if len(found) == 1:
            self._single[data[16:-56]] = layout
        else:
            same_length = self._several.setdefault(len(data), [])
            if len(same_length) >= _MAX_SAME_LENGTH:
                return None
            mask = bytearray(b"\xff" * len(data))
            for offsets in found:
                mask[offsets.header : offsets.header + 12] = bytes(12)
                mask[offsets.body : offsets.body + _BODY.size] = bytes(_BODY.size)
            unchanged = int.from_bytes(mask, "little")
            same_length.append((unchanged, int.from_bytes(data, "little") & unchanged, layout))
        self._count += 1
        return layout


def _find_transforms(data: bytes) -> list[_Offsets]:
    found = []
    try:
        (count,) = _COUNT.unpack_from(data)
        end = 4
        for _ in range(count):
            header = end
            *_, length = _HEAD.unpack_from(data, end)
            end += 16
            parent = data[end : end + length].decode("utf-8", "replace")
            end += length
            (length,) = _COUNT.unpack_from(data, end)
            end += 4
            child = data[end : end + length].decode("utf-8", "replace")
            end += length
            found.append(_Offsets(without_slash(parent), without_slash(child), header, end))
            end += _BODY.size
    except (struct.error, OverflowError) as error:  # OverflowError: an offset exceeds 32 bits
        raise DeserializationError(error) from error
    if end > len(data):
        raise DeserializationError("the message ends too early")

    return found


def without_slash(name: str) -> str:
    """Return a frame's name as tf2 stores it: without one leading slash."""
    return name[1:] if name.startswith("/") else name


def _sample(data: bytes, offsets: _Offsets) -> TransformSample:
    x, y, z, qx, qy, qz, qw = _BODY.unpack_from(data, offsets.body)
    return TransformSample(offsets.parent, offsets.child, _stamp(data, offsets), (x, y, z), (qx, qy, qz, qw))


def _stamp(data: bytes, offsets: _Offsets) -> int:
    secs, nsecs = _STAMP.unpack_from(data, offsets.header + 4)
    return int(secs * 1_000_000_000 + nsecs)


def _is_valid(sample: TransformSample) -> bool:
    x, y, z, w = sample.rotation
    return abs(x * x + y * y + z * z + w * w - 1.0) < 0.01 and not math.isnan(sum(sample.translation))
