"""An actionlib_msgs/GoalStatusArray built from serialized statuses and parsed only on demand.

A server publishes each goal's status for a few seconds after the goal has ended, so a busy server publishes thousands of
statuses at a time. A client needs only those of its own goals.
"""

from __future__ import annotations

import struct
from io import BytesIO

from actionlib_msgs.msg import GoalStatus, GoalStatusArray

from minirospy.core.idl.protocols import Buffer, Writer

__all__ = ["StatusList", "find_status", "status_bytes"]

_HEADER = struct.Struct("<4I")
_COUNT = struct.Struct("<I")
_STAMP_AND_LENGTH = struct.Struct("<3I")
_STATUS_AND_LENGTH = struct.Struct("<BI")


def status_bytes(status: GoalStatus) -> bytes:
    """Serialize a status."""
    buffer = BytesIO()
    status.serialize(buffer)
    return buffer.getvalue()


def _parse(data: bytes) -> GoalStatus:
    status = GoalStatus()
    status.deserialize(data)
    return status


class StatusList(GoalStatusArray):
    """A GoalStatusArray built from serialized statuses and parsed on first access."""

    _takes_memoryview = False

    def __init__(self, parts: list[bytes] | None = None) -> None:
        self._parts = parts or []
        self._data = b""
        self._start = 0
        self._count = len(self._parts)
        self._read: list[GoalStatus] | None = None
        super().__init__()

    @property
    def status_list(self) -> list[GoalStatus]:
        """Return the statuses, parsed on first access."""
        if self._read is None:
            parts = self._parts or [self._data[start:end] for start, end in self._bounds()]
            self._read = list(map(_parse, parts))
        return self._read

    @status_list.setter
    def status_list(self, statuses: list[GoalStatus]) -> None:
        # The base class sets an empty list; None makes the next access parse the bytes.
        self._read = statuses or None

    def find(self, id: str) -> GoalStatus | None:
        """Return a goal's status, or None if the goal is not in the list."""
        name = id.encode()
        key = _COUNT.pack(len(name)) + name
        if key not in self._data:
            return None
        # Check the position, because another goal's text may contain the same bytes.
        for start, end in self._bounds():
            if self._data.startswith(key, start + 8):
                return _parse(self._data[start:end])
        return None

    def serialize(self, buff: Writer) -> None:
        """Serialize the message. Raise genpy.SerializationError if a field is invalid."""
        if self._read is not None:
            self._parts = [status_bytes(status) for status in self._read]
        stamp = self.header.stamp
        frame_id = self.header.frame_id.encode()
        buff.write(_HEADER.pack(self.header.seq, stamp.secs, stamp.nsecs, len(frame_id)))
        buff.write(frame_id)
        buff.write(_COUNT.pack(len(self._parts)))
        buff.write(b"".join(self._parts))

    def deserialize(self, data: Buffer) -> StatusList:
        """Store the message's bytes, parsing only the header. Raise genpy.DeserializationError if the bytes are invalid."""
        data = bytes(data)
        try:
            seq, secs, nsecs, length = _HEADER.unpack_from(data)
            self._start = _HEADER.size + length + _COUNT.size
            (self._count,) = _COUNT.unpack_from(data, self._start - _COUNT.size)
        # OverflowError: the offset is out of struct's range
        except (struct.error, OverflowError):
            self._fail(data)
        self.header.seq = seq
        self.header.stamp.secs, self.header.stamp.nsecs = secs, nsecs
        self.header.frame_id = data[_HEADER.size : _HEADER.size + length].decode("utf-8", "replace")
        self._data = data
        self._read = None
        self._parts = []
        return self

    def _bounds(self) -> list[tuple[int, int]]:
        """Return each status's start and end offset."""
        bounds = []
        data, end = self._data, self._start
        try:
            for _ in range(self._count if data else 0):
                start = end
                end += 17 + _STAMP_AND_LENGTH.unpack_from(data, start)[2]
                end += _STATUS_AND_LENGTH.unpack_from(data, end - 5)[1]
                bounds.append((start, end))
        # OverflowError: the offset is out of struct's range
        except (struct.error, OverflowError):
            self._fail(data)
        return bounds

    def _fail(self, data: bytes) -> None:
        # Let the generated class raise DeserializationError for this data, with the usual error text.
        GoalStatusArray().deserialize(data)


def find_status(statuses: GoalStatusArray, id: str) -> GoalStatus | None:
    """Return a goal's status from a GoalStatusArray, or None if the goal is not in the list."""
    if isinstance(statuses, StatusList):
        return statuses.find(id)
    for status in statuses.status_list:
        if status.goal_id.id == id:
            return status
    return None
