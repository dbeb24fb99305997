"""Create message classes whose number arrays are numpy arrays, for `rospy.numpy_msg`.

numpy is imported only when a class is created. Source: http://wiki.ros.org/rospy_tutorials/Tutorials/numpy.
"""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType
from typing import TypeVar

from minirospy.base.errors import MinirospyError
from minirospy.base.installation import install_command
from minirospy.core.idl.arrays import arrays_from_bytes
from minirospy.core.idl.message import Message as BaseMessage
from minirospy.core.idl.protocols import Buffer, Message, Writer, declared

__all__ = ["NumpyMissingError", "numpy_class"]

_M = TypeVar("_M", bound=Message)


class NumpyMissingError(MinirospyError, ImportError):
    """numpy is not installed."""

    def __str__(self) -> str:
        return f"numpy_msg needs numpy, which is not installed: {install_command('numpy')}"


@lru_cache(maxsize=256)
def numpy_class(message_class: type[_M]) -> type[_M]:
    """Return a message class whose arrays are numpy arrays. To peers, it has the same type as ``message_class``.

    Raise NumpyMissingError if numpy is not installed.
    """
    try:
        import numpy
    except ImportError as error:
        raise NumpyMissingError from error
    if getattr(message_class, "_takes_numpy", False):
        return message_class

    # Do not use genpy's generated code if it would fail: it calls ndarray.tostring, which numpy 2.3 removed.
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


def _own_methods(message_class: type[Message], numpy: ModuleType) -> dict[str, object]:
    def deserialize(self: Message, data: Buffer) -> Message:
        message_class.deserialize(self, data)
        return arrays_from_bytes(self, numpy)

    # minirospy's serialize accepts numpy arrays as well as lists.
    flags = ("_takes_memoryview", "_takes_split_frames")
    return {
        "deserialize": deserialize,
        **{name: declared(message_class, "deserialize", name) for name in flags},
    }


def _genpy_methods(_: type[Message], numpy: ModuleType) -> dict[str, object]:
    def serialize(self: BaseMessage, buff: Writer) -> None:
        self.serialize_numpy(buff, numpy)

    def deserialize(self: BaseMessage, data: Buffer) -> BaseMessage:
        return self.deserialize_numpy(data, numpy)

    return {"serialize": serialize, "deserialize": deserialize}
