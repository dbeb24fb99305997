"""The functions of genpy that differ from minirospy's. Source: http://docs.ros.org/api/genpy/html/."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.base.errors import DeserializationError, MessageException, SerializationError
from minirospy.base.times import Duration, Time, TVal
from minirospy.core.idl.field_checks import check_type
from minirospy.core.idl.fill_message import fill_message_args
from minirospy.core.idl.message import Message
from minirospy.core.idl.message_text import get_printable_message_args, strify_message
from minirospy.ros.genpy.genpy.base import is_simple
from minirospy.ros.genpy.genpy.run_time import RosMsgUnicodeErrors, struct_I

if TYPE_CHECKING:
    from minirospy.core.idl import protocols
    from minirospy.core.idl.protocols import ServiceClass

__all__ = [
    "DeserializationError",
    "Duration",
    "Message",
    "MessageException",
    "RosMsgUnicodeErrors",
    "SerializationError",
    "TVal",
    "Time",
    "_get_message_or_service_class",
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


def get_message_class(message_type: str, reload_on_error: bool = False) -> type[protocols.Message] | None:
    """Return the message class ``pkg/Name``, or None if there is no such class. Raise ValueError if the type name is invalid."""
    from minirospy.core.idl import load

    return load.get_message_class(_checked(message_type))


def get_service_class(service_type: str, reload_on_error: bool = False) -> ServiceClass | None:
    """Return the service class ``pkg/Name``, or None if there is no such class. Raise ValueError if the type name is invalid."""
    from minirospy.core.idl import load

    return load.get_service_class(_checked(service_type))


def isstring(s: object) -> bool:
    """Return whether a value is a str."""
    return isinstance(s, str)


def _get_message_or_service_class(
    type_str: str, message_type: str, reload_on_error: bool = False
) -> type[protocols.Message] | ServiceClass | None:
    """Return the class for a ``message`` or ``service``, or None if none exists. Raise ValueError if the name is invalid."""
    if type_str == "service":
        return get_service_class(message_type, reload_on_error)
    return get_message_class(message_type, reload_on_error)


def _checked(type_: str) -> str:
    if type_ == "Header":
        return "std_msgs/Header"
    if type_.count("/") > 1:
        raise ValueError(f"invalid name [{type_}]")
    if "/" not in type_[1:]:
        raise ValueError(f"message type is missing package name: {type_}")
    return type_
