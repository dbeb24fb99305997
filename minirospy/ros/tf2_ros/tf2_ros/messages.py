"""Converts TransformStamped messages, times and undecoded /tf messages to and from the buffer's numbers."""

from __future__ import annotations

from typing import Any, Protocol

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from minirospy.client.time import Time
from minirospy.core.tf2.buffer import StampedTransform

__all__ = ["LazyTFMessage", "Moment", "nanoseconds", "transform_stamped"]

_BILLION = 1_000_000_000
_new: Any = object.__new__


class Moment(Protocol):
    """A time or duration from rospy, genpy or a similar module."""

    def to_sec(self) -> float:
        """Return the time in seconds."""


def nanoseconds(time: Moment) -> int:
    """Return a time in nanoseconds. The result is exact if the time has ``secs`` and ``nsecs``.

    Like tf2_py, raise TypeError if the argument is not a time.
    """
    try:
        return time.secs * _BILLION + time.nsecs  # type: ignore[attr-defined, no-any-return]
    except AttributeError:
        pass
    try:
        return int(time.to_sec() * 1e9)
    except AttributeError:
        raise TypeError("time must have a to_sec method, e.g. rospy.Time or rospy.Duration") from None


def transform_stamped(target: str, source: str, found: StampedTransform) -> TransformStamped:
    """Convert the result of a lookup to a message."""
    # Create the message without its constructors, which would take longer than the lookup.
    message: TransformStamped = _new(TransformStamped)
    message.header = header = _new(Header)
    header.seq = 0
    header.stamp = stamp = _new(Time)
    stamp.secs, stamp.nsecs = divmod(found.stamp, _BILLION)
    header.frame_id = target
    message.child_frame_id = source
    message.transform = transform = _new(Transform)
    transform.translation = where = _new(Vector3)
    where.x, where.y, where.z = found.translation
    transform.rotation = turn = _new(Quaternion)
    turn.x, turn.y, turn.z, turn.w = found.rotation
    return message


class LazyTFMessage(TFMessage):
    """A TFMessage that keeps its serialized bytes in ``raw`` and is decoded only if ``transforms`` is read."""

    __slots__ = ["raw"]
    _slot_types = TFMessage._slot_types

    def __init__(self, *args: Any, **kwds: Any) -> None:
        if args or kwds:
            super().__init__(*args, **kwds)
        self.raw: bytes | None = None

    def deserialize(self, data: Any) -> LazyTFMessage:
        """Store the bytes without decoding them."""
        self.raw = data
        return self

    def __getattr__(self, name: str) -> list[TransformStamped]:
        if name != "transforms" or self.raw is None:
            raise AttributeError(f"'{type(self).__name__}' object has no attribute '{name}'")
        super().deserialize(self.raw)
        return self.transforms
