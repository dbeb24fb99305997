"""Convert a message's number arrays to numpy arrays.

Received array bytes become a numpy array without creating Python numbers; like genpy's, it is read-only.
Arrays of uint8 and char remain bytes. numpy is imported only when a message needs it.
Source: http://wiki.ros.org/rospy_tutorials/Tutorials/numpy.
"""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType
from typing import NamedTuple

from minirospy.core.idl.protocols import Message

__all__ = ["arrays_from_bytes"]

_DTYPES = {
    "bool": "bool",
    "byte": "int8",
    "float32": "float32",
    "float64": "float64",
    **{f"{sign}int{bits}": f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)},
}
# Arrays of these types are not converted.
_KEPT = {"uint8", "char", "string", "time", "duration"}


def arrays_from_bytes(message: Message, numpy: ModuleType) -> Message:
    """Convert the number arrays in a message that was just deserialized into numpy arrays; return the message."""
    raw = getattr(message, "_raw", {})

    for name, base, is_array in _fields(_class_of(message)):
        dtype = _DTYPES.get(base)
        if dtype is None:
            value = getattr(message, name)
            for inner in value if is_array else (value,):
                if _is_plain(inner):
                    # The other elements have the same type, so do not check them.
                    break
                arrays_from_bytes(inner, numpy)
        elif name in raw:
            # ROS's byte order is little-endian on every machine.
            setattr(message, name, numpy.frombuffer(raw[name], numpy.dtype(dtype).newbyteorder("<")))
        else:
            values = numpy.array(getattr(message, name), dtype)
            values.flags.writeable = False
            setattr(message, name, values)

    return message


class _Field(NamedTuple):
    name: str
    base: str
    is_array: bool


@lru_cache(maxsize=1024)
def _fields(message_class: type[Message]) -> tuple[_Field, ...]:
    """Return a message class's fields that are number arrays or messages."""
    found = []
    for name, type_ in zip(message_class.__slots__, message_class._slot_types, strict=True):
        base, array, _ = type_.partition("[")
        if base not in _KEPT and (array or base not in _DTYPES):
            found.append(_Field(name, base, bool(array)))
    return tuple(found)


def _is_plain(message: Message) -> bool:
    """Return whether messages of this type can never contain a number array."""
    return all(
        field.base not in _DTYPES and not field.is_array and _is_plain(getattr(message, field.name))
        for field in _fields(_class_of(message))
    )


def _class_of(message: Message) -> type[Message]:
    return type(message)
