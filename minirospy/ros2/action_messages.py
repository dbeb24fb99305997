"""Serializes and parses ROS 1 action messages. Embedded goals, feedback and results stay serialized. Pure.

Source: http://wiki.ros.org/actionlib/DetailedDescription, and the definitions of actionlib_msgs.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import NamedTuple

from minirospy.base.errors import DeserializationError

__all__ = [
    "GoalId",
    "Status",
    "cancel_message",
    "goal_message",
    "parse_cancel",
    "parse_goal",
    "parse_status_and_body",
    "parse_statuses",
    "status_and_body",
    "statuses_message",
]

_HEADER = struct.Struct("<4I")
_STAMP = struct.Struct("<2I")
_LENGTH = struct.Struct("<I")


class GoalId(NamedTuple):
    """A goal's ID, and its send time in seconds and nanoseconds."""

    id: str
    secs: int = 0
    nsecs: int = 0

    @property
    def nanoseconds(self) -> int:
        """Return the send time in nanoseconds, or 0 if it is not set."""
        return self.secs * 1_000_000_000 + self.nsecs


class Status(NamedTuple):
    """A goal's status: the number of a GoalState, and a readable text."""

    goal: GoalId
    state: int
    text: str = ""


def goal_message(goal: GoalId, body: bytes) -> bytes:
    """Serialize an ActionGoal."""
    return _header(goal.secs, goal.nsecs) + _goal_id(goal) + body


def parse_goal(data: bytes | memoryview) -> tuple[GoalId, bytes]:
    """Return the goal ID and the body of an ActionGoal. Raise DeserializationError if the data is invalid."""
    data = bytes(data)
    goal, end = _parse_goal_id(data, _parse_header(data))
    return goal, data[end:]


def cancel_message(goal: GoalId) -> bytes:
    """Serialize a GoalID."""
    return _goal_id(goal)


def parse_cancel(data: bytes | memoryview) -> GoalId:
    """Parse a GoalID. Raise DeserializationError if the data is invalid."""
    return _parse_goal_id(bytes(data), 0)[0]


def status_and_body(secs: int, nsecs: int, status: Status, body: bytes) -> bytes:
    """Serialize an ActionFeedback or ActionResult from its status and its serialized body."""
    return _header(secs, nsecs) + _status(status) + body


def parse_status_and_body(data: bytes | memoryview) -> tuple[Status, bytes]:
    """Return the status and body of an ActionFeedback or ActionResult. Raise DeserializationError if the data is invalid."""
    data = bytes(data)
    status, end = _parse_status(data, _parse_header(data))
    return status, data[end:]


def statuses_message(secs: int, nsecs: int, statuses: Iterable[Status]) -> bytes:
    """Serialize a GoalStatusArray."""
    parts = [_status(each) for each in statuses]
    return _header(secs, nsecs) + _LENGTH.pack(len(parts)) + b"".join(parts)


def parse_statuses(data: bytes | memoryview) -> list[Status]:
    """Parse a GoalStatusArray. Raise DeserializationError if the data is invalid."""
    data = bytes(data)
    end = _parse_header(data)
    (count,) = _unpacked(_LENGTH, data, end)
    end += _LENGTH.size
    found = []
    for _ in range(count):
        status, end = _parse_status(data, end)
        found.append(status)
    return found


def _header(secs: int, nsecs: int) -> bytes:
    return _HEADER.pack(0, secs, nsecs, 0)


def _parse_header(data: bytes) -> int:
    *_, length = _unpacked(_HEADER, data, 0)
    return _HEADER.size + length


def _goal_id(goal: GoalId) -> bytes:
    return _STAMP.pack(goal.secs, goal.nsecs) + _text(goal.id)


def _parse_goal_id(data: bytes, start: int) -> tuple[GoalId, int]:
    secs, nsecs = _unpacked(_STAMP, data, start)
    id, end = _parse_text(data, start + _STAMP.size)
    return GoalId(id, secs, nsecs), end


def _status(status: Status) -> bytes:
    return _goal_id(status.goal) + bytes((status.state,)) + _text(status.text)


def _parse_status(data: bytes, start: int) -> tuple[Status, int]:
    goal, end = _parse_goal_id(data, start)
    if end >= len(data):
        raise DeserializationError("the message ends too early")
    text, after = _parse_text(data, end + 1)
    return Status(goal, data[end], text), after


def _text(text: str) -> bytes:
    data = text.encode("utf-8", "surrogateescape")
    return _LENGTH.pack(len(data)) + data


def _parse_text(data: bytes, start: int) -> tuple[str, int]:
    (length,) = _unpacked(_LENGTH, data, start)
    end = start + _LENGTH.size + length
    if end > len(data):
        raise DeserializationError("the message ends too early")
    return data[start + _LENGTH.size : end].decode("utf-8", "surrogateescape"), end


def _unpacked(struct_: struct.Struct, data: bytes, start: int) -> tuple[int, ...]:
    try:
        return struct_.unpack_from(data, start)
    except (struct.error, OverflowError) as error:  # OverflowError: the offset exceeds 32 bits
        raise DeserializationError("the message ends too early") from error
