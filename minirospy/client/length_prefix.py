"""Read and write messages with a length prefix, as TCPROS sends them. Source: http://wiki.ros.org/ROS/TCPROS."""

from __future__ import annotations

import struct
from io import BytesIO
from typing import TYPE_CHECKING

from minirospy.base.errors import DeserializationError
from minirospy.core.idl.message import number_header

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message

__all__ = ["deserialize_messages", "serialize_message"]

_LENGTH = struct.Struct("<I")


def serialize_message(b: BytesIO, seq: int, msg: Message) -> None:
    """Write ``msg``, preceded by its length, to ``b``. Set the header's ``seq``, and clear its frame_id if that was "0"."""
    number_header(msg, seq)
    start = b.tell()
    b.write(b"\0\0\0\0")
    msg.serialize(b)
    end = b.tell()
    b.seek(start)
    b.write(_LENGTH.pack(end - start - 4))
    b.seek(end)


def deserialize_messages(
    b: BytesIO,
    msg_queue: list[Message],
    data_class: type[Message],
    queue_size: int | None = None,
    max_msgs: int | None = None,
    start: int = 0,
) -> None:
    """Move the complete messages between ``start`` and the position of ``b`` to ``msg_queue``.

    Move at most ``max_msgs``; keep only the newest ``queue_size``. An incomplete message is moved to the
    front of ``b``. Raise DeserializationError if a message is invalid.
    """
    data, position, count = b.getvalue()[: b.tell()], start, 0
    while (max_msgs is None or count < max_msgs) and len(data) - position >= 4:
        (size,) = _LENGTH.unpack_from(data, position)
        if len(data) - position - 4 < size:
            break
        message = data_class()
        try:
            message.deserialize(data[position + 4 : position + 4 + size])
        except (struct.error, ValueError, IndexError) as error:
            raise DeserializationError(f"cannot deserialize {data_class._type}: {error}") from error
        msg_queue.append(message)
        position += 4 + size
        count += 1
    if queue_size is not None:
        del msg_queue[: max(0, len(msg_queue) - queue_size)]
    if position > start:
        b.seek(0)
        b.truncate()
        b.write(data[position:])
