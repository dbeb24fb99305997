"""genpy's functions where they differ from ours; `import genpy` re-exports them.

Also what modules that real genpy generated need at run time: ``struct_I`` and the error handler ``rosmsg``.
Source: http://docs.ros.org/api/genpy/html/.
"""

from __future__ import annotations

import codecs
import struct
from typing import TYPE_CHECKING

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

struct_I = struct.Struct("<I")


class RosMsgUnicodeErrors:
    """Replaces bytes that are not UTF-8, and logs it once for a message type."""

    def __init__(self) -> None:
        self.msg_type: str | None = None
        self._warned: set[str | None] = set()

    def __call__(self, error: UnicodeError) -> tuple[str | bytes, int]:
        if self.msg_type not in self._warned:
            self._warned.add(self.msg_type)
            import logging

            logging.getLogger("rosout").error(
                "Characters replaced when decoding message %s (will print only once): %s",
                self.msg_type,
                error,
            )
        return codecs.replace_errors(error)


def register_unicode_errors() -> None:
    """Make ``errors="rosmsg"`` known to codecs, unless it is: modules that real genpy generated name it."""
    try:
        codecs.lookup_error("rosmsg")
    except LookupError:
        codecs.register_error("rosmsg", RosMsgUnicodeErrors())


def get_message_class(message_type: str, reload_on_error: bool = False) -> type[protocols.Message] | None:
    """Return the class of ``pkg/Name``, or None. Raise ValueError on an invalid type name."""
    from minirospy.core.idl import load

    return load.get_message_class(_checked(message_type))


def get_service_class(service_type: str, reload_on_error: bool = False) -> ServiceClass | None:
    """Return the class of the service ``pkg/Name``, or None. Raise ValueError on an invalid type name."""
    from minirospy.core.idl import load

    return load.get_service_class(_checked(service_type))


def isstring(s: object) -> bool:
    """Return whether a value is a str."""
    return isinstance(s, str)


def _get_message_or_service_class(
    type_str: str, message_type: str, reload_on_error: bool = False
) -> type[protocols.Message] | ServiceClass | None:
    """Return the class of a ``message`` or ``service``, or None. Raise ValueError on an invalid type name."""
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


register_unicode_errors()
