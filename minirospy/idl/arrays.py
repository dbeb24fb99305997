"""Messages whose arrays of numbers are numpy arrays.

An array that came as bytes becomes one of numpy without any number of Python in between, read-only as genpy's are.
Arrays of uint8 and char stay bytes. Nothing here imports numpy before a message needs it.
Source: http://wiki.ros.org/rospy_tutorials/Tutorials/numpy.
"""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType
from typing import NamedTuple, TypeVar

from minirospy.errors import MinirospyError
from minirospy.idl.message import Message as BaseMessage
from minirospy.idl.protocols import Buffer, Message, Writer

__all__ = ["NumpyMissingError", "arrays_from_bytes", "numpy_class"]

_M = TypeVar("_M", bound=Message)

_DTYPES = {
    "bool": "bool",
    "byte": "int8",
    "float32": "float32",
    "float64": "float64",
    **{f"{sign}int{bits}": f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)},
}
# Arrays of these stay what they are.
_KEPT = {"uint8", "char", "string", "time", "duration"}


class NumpyMissingError(MinirospyError, ImportError):
    """numpy is not installed."""

    def __str__(self) -> str:
        return "numpy_msg needs numpy, which is not installed: pip install numpy"


@lru_cache(maxsize=256)
def numpy_class(message_class: type[_M]) -> type[_M]:
    """Return the class of a message whose arrays are numpy arrays: the same type to every peer.

    Raise NumpyMissingError.
    """
    try:
        import numpy
    except ImportError as error:
        raise NumpyMissingError from error
    if getattr(message_class, "_takes_numpy", False):
        return message_class

    # What genpy generated writes with ndarray.tostring, which numpy 2.3 has no more.
    is_ours = getattr(message_class, "serialize_numpy", None) is BaseMessage.serialize_numpy
    makes_methods = _own_methods if is_ours or not hasattr(numpy.ndarray, "tostring") else _genpy_methods
    fields = {
        name: getattr(message_class, name)
        for name in ("_slot_types", "_type", "_md5sum", "_full_text", "_has_header")
    }
    return type(
        f"Numpy_{message_class._type.replace('/', '__')}",
        (message_class,),
        {
            **fields,
            "__slots__": message_class.__slots__,
            "__doc__": f"{message_class._type} with numpy arrays",
            "__module__": "rospy.numpy_msg",
            "_takes_numpy": True,
            **makes_methods(message_class, numpy),
        },
    )


def arrays_from_bytes(message: Message, numpy: ModuleType) -> Message:
    """Return the message, just read from bytes, with each of its arrays of numbers as a numpy array."""
    raw = getattr(message, "_raw", {})

    for name, base, is_array in _fields(_class_of(message)):
        dtype = _DTYPES.get(base)
        if dtype is None:
            value = getattr(message, name)
            for inner in value if is_array else (value,):
                if _is_plain(inner):
                    # So are the others of its type.
                    break
                arrays_from_bytes(inner, numpy)
        elif name in raw:
            # Bytes are in ROS's order, on every machine.
            setattr(message, name, numpy.frombuffer(raw[name], numpy.dtype(dtype).newbyteorder("<")))
        else:
            values = numpy.array(getattr(message, name), dtype)
            values.flags.writeable = False
            setattr(message, name, values)

    return message


def _own_methods(message_class: type[Message], numpy: ModuleType) -> dict[str, object]:
    def deserialize(self: Message, data: Buffer) -> Message:
        message_class.deserialize(self, data)
        return arrays_from_bytes(self, numpy)

    # Their serialize takes numpy arrays as it takes lists.
    return {"deserialize": deserialize}


def _genpy_methods(_: type[Message], numpy: ModuleType) -> dict[str, object]:
    def serialize(self: BaseMessage, buff: Writer) -> None:
        self.serialize_numpy(buff, numpy)

    def deserialize(self: BaseMessage, data: Buffer) -> BaseMessage:
        return self.deserialize_numpy(data, numpy)

    return {"serialize": serialize, "deserialize": deserialize}


class _Field(NamedTuple):
    name: str
    base: str
    is_array: bool


@lru_cache(maxsize=1024)
def _fields(message_class: type[Message]) -> tuple[_Field, ...]:
    """Return the fields of a class that are arrays of numbers, or messages."""
    found = []
    for name, type_ in zip(message_class.__slots__, message_class._slot_types, strict=True):
        base, array, _ = type_.partition("[")
        if base not in _KEPT and (array or base not in _DTYPES):
            found.append(_Field(name, base, bool(array)))
    return tuple(found)


def _is_plain(message: Message) -> bool:
    """Return whether no message of this one's type can hold an array of numbers."""
    return all(
        field.base not in _DTYPES and not field.is_array and _is_plain(getattr(message, field.name))
        for field in _fields(_class_of(message))
    )


def _class_of(message: Message) -> type[Message]:
    return type(message)
