"""genpy.message, provided by minirospy."""

from minirospy.base.times import Duration, Time, TVal
from minirospy.core.idl.message import (
    DeserializationError,
    Message,
    MessageException,
    SerializationError,
    check_type,
    fill_message_args,
    get_printable_message_args,
    strify_message,
)
from minirospy.ros.genpy.genpy.base import is_simple
from minirospy.ros.genpy.genpy.message import (
    RosMsgUnicodeErrors,
    get_message_class,
    get_service_class,
    isstring,
    struct_I,
)

__all__ = [
    "DeserializationError",
    "Duration",
    "Message",
    "MessageException",
    "RosMsgUnicodeErrors",
    "SerializationError",
    "TVal",
    "Time",
    "check_type",
    "fill_message_args",
    "get_message_class",
    "get_printable_message_args",
    "get_service_class",
    "is_simple",
    "isstring",
    "strify_message",
    "struct_I",
]
from minirospy.ros.genpy.genpy.message import _get_message_or_service_class as _get_message_or_service_class
