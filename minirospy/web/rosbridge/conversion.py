"""Convert messages to dictionaries, for JSON and CBOR, and back, with rosbridge's rules and error messages. Pure.

uint8[] and char[] become base64 (in CBOR: bytes), NaN and infinities become null (in JSON), and times become {secs,
nsecs}. Source: ROSBRIDGE_PROTOCOL.md, and the responses of rosbridge_library.
"""

from __future__ import annotations

import base64
import binascii
import functools
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from minirospy.base.errors import BridgeProtocolError
from minirospy.base.times import Duration, Time
from minirospy.core.idl.protocols import Message
from minirospy.web.rosbridge.cbor import TYPED_ARRAYS, typed_array

__all__ = ["ConversionError", "cbor_values", "fill", "request_values", "values"]

_ARRAY = re.compile(r"(.*)\[(\d*)\]\Z")
_BYTES = ("uint8", "char")
_FLOATS = ("float32", "float64")
_INTEGERS = ("int8", "byte", "uint8", "char", "int16", "uint16", "int32", "uint32", "int64", "uint64")
_PRIMITIVES = ("bool", "string", *_INTEGERS, *_FLOATS)
_TIMES = ("time", "duration")
_HEADERS = ("Header", "std_msgs/Header", "roslib/Header")
_TAKES: Mapping[type, tuple[str, ...]] = {
    bool: ("bool",),
    int: (*_INTEGERS, *_FLOATS),
    float: _FLOATS,
    str: ("string",),
}
_Convert = Callable[[Any], object]


class ConversionError(BridgeProtocolError):
    """Raised if a value does not match a message's field."""


# --- messages -> dictionaries


def values(message: Message) -> dict[str, object]:
    """Convert a message to a dictionary of JSON-compatible values."""
    return {name: convert(getattr(message, name)) for name, convert in _json_fields(type(message))}


def cbor_values(message: Message) -> dict[str, object]:
    """Convert a message to a dictionary of CBOR-compatible values."""
    return {name: convert(getattr(message, name)) for name, convert in _cbor_fields(type(message))}


@functools.lru_cache(maxsize=1000)
def _json_fields(class_: type[Message]) -> tuple[tuple[str, _Convert], ...]:
    types: Sequence[str] = class_._slot_types
    return tuple((name, _to_json(type_)) for name, type_ in zip(class_.__slots__, types, strict=True))


@functools.lru_cache(maxsize=1000)
def _cbor_fields(class_: type[Message]) -> tuple[tuple[str, _Convert], ...]:
    types: Sequence[str] = class_._slot_types
    return tuple((name, _to_cbor(type_)) for name, type_ in zip(class_.__slots__, types, strict=True))


def _to_json(type_: str) -> _Convert:
    if array := _ARRAY.match(type_):
        element = array[1]
        if element in _BYTES:
            return _base64
        if element in _FLOATS:
            return _floats
        if element in _PRIMITIVES:
            return list
        convert = _to_json(element)
        return lambda found: [convert(each) for each in found]
    if type_ in _TIMES:
        return _time
    if type_ in _FLOATS:
        return _float
    return _same if type_ in _PRIMITIVES else values


def _to_cbor(type_: str) -> _Convert:
    if array := _ARRAY.match(type_):
        element = array[1]
        if element in _BYTES:
            return bytes
        if element in TYPED_ARRAYS:
            return functools.partial(typed_array, element)
        if element == "bool":
            return lambda found: [bool(each) for each in found]
        if element in _PRIMITIVES:
            return list
        convert = _to_cbor(element)
        return lambda found: [convert(each) for each in found]
    if type_ in _TIMES:
        return _time
    if type_ == "bool":
        return bool
    return _same if type_ in _PRIMITIVES else cbor_values


def _same(found: object) -> object:
    return found


def _base64(found: bytes | Sequence[int]) -> str:
    return base64.b64encode(found if isinstance(found, bytes) else bytes(found)).decode()


def _float(found: float) -> float | None:
    return found if math.isfinite(found) else None


def _floats(found: Sequence[float]) -> list[float | None]:
    # The sum of finite numbers is finite unless it overflows, so this fast check suffices for most arrays.
    if math.isfinite(sum(found)):
        return list(found)
    return [each if math.isfinite(each) else None for each in found]


def _time(found: Time | Duration) -> dict[str, int]:
    return {"secs": found.secs, "nsecs": found.nsecs}


# --- dictionaries -> messages


def fill(message: Message, found: object, now: Callable[[], Time]) -> None:
    """Set a message's fields from a dictionary. A header without a stamp gets the current time.

    Raise ConversionError, with rosbridge's message, if a field is unknown or a value has the wrong type.
    """
    _fill(message, found, message._type, message._type, (), now)


def request_values(message: Message, arguments: object) -> Mapping[str, object]:
    """Return a call's arguments (a dictionary, or a list in field order) as a dictionary of the request's fields.

    For other arguments, return no fields.
    """
    if isinstance(arguments, dict):
        return arguments
    if isinstance(arguments, list):
        return dict(zip(message.__slots__, arguments, strict=False))
    return {}


def _fill(
    message: Any, found: object, type_: str, root: str, path: tuple[str, ...], now: Callable[[], Time]
) -> None:
    if not isinstance(found, dict):
        raise _mismatch(root, path, type_, found)
    if type_ in _HEADERS:
        message.stamp = now()
    fields = dict(zip(message.__slots__, message._slot_types, strict=True))
    for name, value in found.items():
        inner = (*path, str(name))
        if name not in fields:
            raise ConversionError(f"Message type {root} does not have a field {'.'.join(inner)}")
        setattr(message, name, _from_value(value, fields[name], root, inner, getattr(message, name), now))


def _from_value(
    value: object, type_: str, root: str, path: tuple[str, ...], present: object, now: Callable[[], Time]
) -> object:
    if array := _ARRAY.match(type_):
        return _from_array(value, type_, array[1], root, path, now)
    if type_ in _TIMES:
        return _from_time(value, type_, root, path, present, now)
    if type_ in _PRIMITIVES:
        if type_ not in _TAKES.get(type(value), ()):
            raise _mismatch(root, path, type_, value)
        return value
    _fill(present, value, type_, root, path, now)
    return present


def _from_array(
    value: object, type_: str, element: str, root: str, path: tuple[str, ...], now: Callable[[], Time]
) -> object:
    if element in _BYTES:
        return _from_bytes(value, type_, root, path)
    if not isinstance(value, list):
        raise _mismatch(root, path, type_, value)
    if element in _PRIMITIVES:
        for each in value:
            if element not in _TAKES.get(type(each), ()):
                raise _mismatch(root, path, element, each)
        return value
    make = _maker(element)
    return [_from_value(each, element, root, path, make(), now) for each in value]


def _from_bytes(value: object, type_: str, root: str, path: tuple[str, ...]) -> bytes:
    try:
        if isinstance(value, str):
            return base64.b64decode(value)
        if isinstance(value, bytes | list):
            return bytes(value)
    except (binascii.Error, ValueError, TypeError) as error:
        raise ConversionError(
            f"{root}: field {'.'.join(path)} is not base64, or not bytes: {error}"
        ) from error
    raise _mismatch(root, path, type_, value)


def _from_time(
    value: object, type_: str, root: str, path: tuple[str, ...], present: object, now: Callable[[], Time]
) -> object:
    if type_ == "time" and value == "now":
        return now()
    if not isinstance(value, dict):
        raise _mismatch(root, path, type_, value)
    # Also accept the names that ROS 2 uses, which roslib.js may send.
    for name, other in (("secs", "sec"), ("nsecs", "nanosec")):
        part = value.get(name, value.get(other, getattr(present, name)))
        if type(part) is not int:
            raise _mismatch(root, (*path, name), "int32", part)
        setattr(present, name, part)
    # Clients may send times with 1e9 or more nanoseconds, and C++ nodes do not normalize the times that they receive.
    present.canon()  # type: ignore[attr-defined]
    return present


def _maker(type_: str) -> Callable[[], object]:
    from minirospy.core.idl.load import message_class

    return Time if type_ == "time" else Duration if type_ == "duration" else message_class(type_)


def _mismatch(root: str, path: tuple[str, ...], expected: str, value: object) -> ConversionError:
    if root == expected:
        return ConversionError(f"Expected a JSON object for type {root} but received a {type(value)}")
    return ConversionError(
        f"{root} message requires a {expected} for field {'.'.join(path)}, but got a {type(value)}"
    )
