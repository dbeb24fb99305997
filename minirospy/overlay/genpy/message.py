"""genpy.message, filled in by minirospy."""

from minirospy.idl.message import (
    DeserializationError,
    Message,
    MessageException,
    SerializationError,
    check_type,
    fill_message_args,
    get_printable_message_args,
    strify_message,
)

__all__ = [
    "DeserializationError",
    "Message",
    "MessageException",
    "SerializationError",
    "check_type",
    "fill_message_args",
    "get_printable_message_args",
    "strify_message",
]
