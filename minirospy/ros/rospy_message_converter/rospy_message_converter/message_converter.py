"""rospy_message_converter.message_converter: converts messages to dicts, and back.

Byte arrays (uint8[], char[]) are base64 strings in dicts, as in JSON; times have ``secs`` and ``nsecs``.
"""

from __future__ import annotations

import base64
import binascii
import re
from collections.abc import Callable, Mapping
from typing import Any

from minirospy import client as rospy
from minirospy.core.idl.load import message_class, service_class
from minirospy.core.idl.protocols import Message

__all__ = ["convert_dictionary_to_ros_message", "convert_ros_message_to_dictionary"]

_ARRAY = re.compile(r"(.*)\[(\d*)\]\Z")
_BINARY = ("uint8", "char")
_INTEGERS = ("int8", "byte", "uint8", "char", "int16", "uint16", "int32", "uint32", "int64", "uint64")
_TYPES: dict[str, tuple[type, ...]] = {
    "bool": (bool,),
    "string": (str,),
    **dict.fromkeys(_INTEGERS, (int,)),
    **dict.fromkeys(("float32", "float64"), (float, int)),
}
_LOGGERS: dict[str, Callable[[str], object]] = {
    "debug": rospy.logdebug,
    "info": rospy.loginfo,
    "warning": rospy.logwarn,
    "error": rospy.logerr,
    "critical": rospy.logfatal,
}


def convert_dictionary_to_ros_message(
    message_type: str,
    dictionary: Mapping[str, object],
    kind: str = "message",
    strict_mode: bool = True,
    check_missing_fields: bool = False,
    check_types: bool = True,
    log_level: str = "error",
) -> Any:
    """Convert a dict to a message of the given type, for example std_msgs/String.

    ``kind``: "message", or "request" or "response" of a service. Unknown fields raise ValueError; unless ``strict_mode``,
    they are only logged. If ``check_missing_fields``, a field without a value raises ValueError; if ``check_types``,
    a value of another type raises TypeError. Raise NotFoundError if the type is unknown.
    """
    if kind == "message":
        message = message_class(message_type)()
    elif kind in ("request", "response"):
        service = service_class(message_type)
        message = (service._request_class if kind == "request" else service._response_class)()
    else:
        raise ValueError(f'Unknown kind "{kind}".')

    options = (strict_mode, check_missing_fields, check_types, log_level)
    fields = dict(zip(message.__slots__, message._slot_types, strict=True))
    for name, value in dictionary.items():
        if name in fields:
            setattr(message, name, _to_ros(name, fields.pop(name), value, options))
            continue
        text = f'ROS message type "{message_type}" has no field named "{name}"'
        if strict_mode:
            raise ValueError(text)
        _LOGGERS[log_level](f"{text}! It will be ignored.")
    if check_missing_fields and fields:
        raise ValueError(f'ROS message type "{message_type}" lacks a value of: {", ".join(fields)}')
    return message


def convert_ros_message_to_dictionary(
    message: Message, binary_array_as_bytes: bool = True
) -> dict[str, object]:
    """Convert a message to a dict. Byte arrays become base64 strings, or lists if ``binary_array_as_bytes`` is False."""
    return {
        name: _from_ros(type_, getattr(message, name), binary_array_as_bytes)
        for name, type_ in zip(message.__slots__, message._slot_types, strict=True)
    }


def _to_ros(name: str, type_: str, value: Any, options: tuple[bool, bool, bool, str]) -> object:
    """Convert a dict's value to a field value. Raise TypeError for a wrong type, ValueError for an invalid value."""
    if array := _ARRAY.match(type_):
        if array[1] in _BINARY:
            return _bytes_of(name, value)
        if options[2] and (isinstance(value, str | bytes | Mapping) or not hasattr(value, "__iter__")):
            raise _wrong(name, value, "list")
        return [_to_ros(name, array[1], each, options) for each in value]
    if type_ in ("time", "duration"):
        return _time_of(name, type_, value)

    if type_ in _TYPES:
        allowed = _TYPES[type_]
        is_fitting = isinstance(value, allowed) and (bool in allowed or not isinstance(value, bool))
        if options[2] and not (is_fitting or hasattr(value, "dtype")):
            raise _wrong(name, value, ", ".join(each.__name__ for each in allowed))
        return value
    if not isinstance(value, Mapping):
        raise _wrong(name, value, "dict")
    strict, missing, types, log_level = options
    return convert_dictionary_to_ros_message(type_, value, "message", strict, missing, types, log_level)


def _wrong(name: str, value: object, valid: str) -> TypeError:
    return TypeError(f"Field '{name}' has wrong type {type(value)} (valid types: {valid})")


def _bytes_of(name: str, value: Any) -> bytes:
    """Convert a base64 string, bytes or a list of numbers to a byte array."""
    try:
        return base64.b64decode(value, validate=True) if isinstance(value, str) else bytes(value)
    except (binascii.Error, ValueError) as error:
        raise ValueError(f"Field '{name}' is not an array of bytes: {error}") from error


def _time_of(name: str, type_: str, value: object) -> object:
    if type_ == "time" and isinstance(value, str) and value == "now":
        return rospy.get_rostime()
    if not isinstance(value, Mapping):
        raise _wrong(name, value, "dict")
    made = rospy.Time if type_ == "time" else rospy.Duration
    return made(int(value.get("secs", 0)), int(value.get("nsecs", 0)))


def _from_ros(type_: str, value: Any, as_text: bool) -> object:
    if array := _ARRAY.match(type_):
        if array[1] in _BINARY:
            data = bytes(value)
            return base64.b64encode(data).decode("ascii") if as_text else list(data)
        return [_from_ros(array[1], each, as_text) for each in value]
    if type_ in ("time", "duration"):
        return {"secs": value.secs, "nsecs": value.nsecs}
    return value if type_ in _TYPES else convert_ros_message_to_dictionary(value, as_text)
