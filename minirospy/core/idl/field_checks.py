"""Checks that the values of a message's fields can be serialized: genpy's rules, and looser ones for what can be sent."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import cast

from minirospy.base.errors import SerializationError
from minirospy.base.times import Duration, Time
from minirospy.core.idl.protocols import is_message

__all__ = ["BUILTIN_TYPES", "check_field", "check_type"]

_INTEGERS = {
    **{f"int{bits}": (-(2 ** (bits - 1)), 2 ** (bits - 1)) for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": (0, 2**bits) for bits in (8, 16, 32, 64)},
    "byte": (-128, 128),
    "char": (0, 256),
}
# roslib/Header is the type's name in packages from before 2011.
_HEADER_TYPES = ("std_msgs/Header", "roslib/Header")


def check_type(field_name: str, field_type: str, field_val: object) -> None:
    """Raise SerializationError unless the value is valid for a field of this type (``int8``, ``string[]``, ``pkg/Name``).

    Like genpy, reject bools as numbers and non-ASCII strings, although both can be sent.
    """
    _check_field(field_name, field_type, field_val, _STRICT_CHECKS)


def check_field(name: str, type_: str, value: object) -> None:
    """Raise SerializationError unless the value can be serialized as a field of this type, which genpy may still refuse."""
    _check_field(name, type_, value, _CHECKS)


_Check = Callable[[str, str, object], None]


def _check_field(name: str, type_: str, value: object, checks: Mapping[str, _Check]) -> None:
    """Raise SerializationError if a field's value, or a value nested in it, fails the check for its type in ``checks``."""
    if type_.endswith("]"):
        _check_array(name, type_.removesuffix("]"), value, checks)
    elif type_ in checks:
        checks[type_](name, type_, value)
    elif not is_message(value) or not hasattr(value, "_check_types"):
        raise SerializationError(f"field {name} must be of type [{type_}]")
    else:
        _check_message_type(name, type_, value._type)
        for inner, inner_type in zip(value.__slots__, value._slot_types, strict=True):
            _check_field(f"{name}.{inner}", inner_type, getattr(value, inner), checks)


def _check_message_type(name: str, expected: str, found: str) -> None:
    if found in _HEADER_TYPES:
        if expected not in ("Header", *_HEADER_TYPES):
            raise SerializationError(f"field {name} must be a Header instead of a {found}")
    elif found != expected:
        raise SerializationError(f"field {name} must be of type {expected} instead of {found}")


def _is_array(value: object) -> bool:
    """Return whether a value is a numpy array, as opposed to a number."""
    return getattr(value, "ndim", 0) != 0


def _check_bool(name: str, type_: str, value: object) -> None:
    if _is_array(value) or value not in (True, False, 0, 1):
        raise SerializationError(f"field {name} is not a bool")


def _check_integer(name: str, type_: str, value: object) -> None:
    low, high = _INTEGERS[type_]
    if not hasattr(value, "__index__") or _is_array(value) or int(value) < 0 <= low:
        kind = "unsigned" if low == 0 else "an"
        raise SerializationError(f"field {name} must be {kind} integer type")
    if not low <= int(value) < high:
        raise SerializationError(f"field {name} exceeds specified width [{type_}]")


def _check_float(name: str, type_: str, value: object) -> None:
    if not isinstance(value, int | float) and (not hasattr(value, "__float__") or _is_array(value)):
        raise SerializationError(f"field {name} must be float type")


def _check_string(name: str, type_: str, value: object) -> None:
    if not isinstance(value, str | bytes):
        raise SerializationError(f"field {name} must be of type bytes or an ascii string")


def _check_time(name: str, type_: str, value: object) -> None:
    if not hasattr(value, "secs") or not hasattr(value, "nsecs"):
        raise SerializationError(f"field {name} must be of type {type_.capitalize()}")


_CHECKS: dict[str, _Check] = {
    "bool": _check_bool,
    "string": _check_string,
    "float32": _check_float,
    "float64": _check_float,
    "time": _check_time,
    "duration": _check_time,
    **dict.fromkeys(_INTEGERS, _check_integer),
}  # functions that check whether a value can be serialized


def _check_strict_integer(name: str, type_: str, value: object) -> None:
    if type(value) is bool:
        kind = "unsigned" if _INTEGERS[type_][0] == 0 else "an"
        raise SerializationError(f"field {name} must be {kind} integer type")
    _check_integer(name, type_, value)


def _check_strict_float(name: str, type_: str, value: object) -> None:
    if type(value) is bool:
        raise SerializationError(f"field {name} must be float type")
    _check_float(name, type_, value)


def _check_strict_string(name: str, type_: str, value: object) -> None:
    _check_string(name, type_, value)
    if isinstance(value, str) and not value.isascii():
        raise SerializationError(f"field {name} is a non-ascii string")


def _check_strict_time(name: str, type_: str, value: object) -> None:
    if not isinstance(value, Time if type_ == "time" else Duration):
        raise SerializationError(f"field {name} must be of type {type_.capitalize()}")


_STRICT_CHECKS: dict[str, _Check] = {
    **_CHECKS,
    "string": _check_strict_string,
    **dict.fromkeys(("float32", "float64"), _check_strict_float),
    **dict.fromkeys(("time", "duration"), _check_strict_time),
    **dict.fromkeys(_INTEGERS, _check_strict_integer),
    # like genpy's checks, but these also accept numpy's numbers, which genpy's messages may contain
}


def _check_array(name: str, type_: str, value: object, checks: Mapping[str, _Check]) -> None:
    base = type_.partition("[")[0]
    if isinstance(value, bytes | bytearray | memoryview) and base in ("uint8", "char"):
        return
    if isinstance(value, str | bytes):
        raise SerializationError(f"field {name} must be a list or tuple type. Only uint8[] can be a string")
    if (
        not isinstance(value, list | tuple)
        and not hasattr(value, "__array__")
        and not hasattr(value, "tolist")
    ):
        raise SerializationError(f"field {name} must be a list or tuple type")
    for item in _items_of_array(name, type_, value, checks):
        _check_field(f"{name}[]", base, item, checks)


def _items_of_array(name: str, type_: str, value: object, checks: Mapping[str, _Check]) -> Iterable[object]:
    """Return the items of an array; flatten a multi-dimensional numpy array in row-major order.

    Raise SerializationError if a fixed-length field cannot be filled from the array's shape.
    """
    shape: tuple[int, ...] = getattr(value, "shape", ())
    if len(shape) < 2:
        return cast("Iterable[object]", value)
    length = type_.partition("[")[2]
    # serialize() takes each row for a number. It therefore fails if the number of rows is the array's length.
    is_refused = checks is _CHECKS and length == str(shape[0])
    if length and (is_refused or length != str(math.prod(shape))):
        hint = ": use reshape(-1)" if is_refused and length == str(math.prod(shape)) else ""
        raise SerializationError(f"field {name} has shape {shape} instead of {length} values{hint}")
    return cast("Iterable[object]", getattr(value, "flat", value))


BUILTIN_TYPES = frozenset(_CHECKS)
"""The names of the types that are not messages."""
