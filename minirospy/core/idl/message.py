"""The base class of generated messages, and messages that are made from the arguments of a call.

The names and rules are genpy's, because user code relies on them: http://docs.ros.org/api/genpy/html/.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import TYPE_CHECKING, TypeVar, cast

from minirospy.base.errors import SerializationError
from minirospy.base.notes import noted
from minirospy.core.idl.protocols import is_message, is_stamped

if TYPE_CHECKING:
    from minirospy.core.idl import protocols
    from minirospy.core.idl.protocols import Buffer, Writer

__all__ = ["Message", "args_kwds_to_message", "number_header"]

_M = TypeVar("_M", bound="protocols.Message")

_SEQUENCES = (list, tuple)


class Message:
    """The base class of all messages. Subclasses have ``_type``, ``_md5sum``, ``_full_text``, ``_slot_types``."""

    __slots__ = ["_connection_header"]
    _type: str
    _md5sum: str
    _full_text: str
    _has_header: bool
    _slot_types: list[str] = []
    _connection_header: dict[str, str]

    def __init__(self, *args: object, **kwds: object) -> None:
        """Set all fields in order, or some by name; None means the field's default.

        Raise TypeError if the number of values is wrong, AttributeError if a name is not a field.
        """
        if args and kwds:
            raise TypeError("Message constructor may only use args OR keywords, not both")
        names = self.__slots__
        if args:
            if len(args) != len(names):
                raise TypeError(f"Invalid number of arguments, args should be {list(names)!s} args are{args}")
            for name, value in zip(names, args, strict=True):
                setattr(self, name, value)
            return
        for name in kwds:
            if name not in names:
                error = AttributeError(f"{name} is not an attribute of {type(self).__name__}")
                kind = getattr(self, "_type", type(self).__name__)  # a class written by hand may lack _type
                raise noted(
                    error,
                    f"a {kind} has the fields {', '.join(names)}" if names else f"a {kind} has no fields",
                )
        for name in names:
            setattr(self, name, kwds.get(name))

    def serialize(self, buff: Writer) -> None:
        """Write this message to ``buff``."""

    def deserialize(self, data: Buffer) -> Message:
        """Read this message from bytes."""
        return self

    def serialize_numpy(self, buff: Writer, numpy: ModuleType) -> None:
        """Write this message, whose arrays may be numpy arrays, to ``buff``."""
        self.serialize(buff)

    def deserialize_numpy(self, data: Buffer, numpy: ModuleType) -> Message:
        """Read this message from bytes; number arrays become numpy arrays."""
        from minirospy.core.idl.arrays import arrays_from_bytes

        self.deserialize(data)
        arrays_from_bytes(cast("protocols.Message", self), numpy)
        return self

    def __getstate__(self) -> list[object]:
        return [getattr(self, name) for name in self.__slots__]

    def __setstate__(self, state: list[object]) -> None:
        for name, value in zip(self.__slots__, state, strict=False):
            setattr(self, name, value)

    def _get_types(self) -> list[str]:
        return self._slot_types

    def _check_types(self, exc: Exception | None = None) -> None:
        """Raise SerializationError for the first invalid field. If all are valid, report ``exc``, the error in writing, if given.

        As in genpy, which does not convert struct's errors, a number that exceeds a float32 raises OverflowError.
        """
        from minirospy.core.idl.field_checks import check_field, check_type

        # If ``exc`` is given, find the field that cannot be written. Otherwise check everything that genpy checks.
        check = check_type if exc is None else check_field
        for name, type_ in zip(self.__slots__, self._get_types(), strict=True):
            check(name, type_, getattr(self, name))
        if isinstance(exc, OverflowError):
            raise OverflowError(str(exc))
        if isinstance(exc, struct.error | TypeError):
            raise SerializationError(f"{type(exc)}: '{exc}' when writing '{self}'")
        if exc is not None:
            raise SerializationError(str(exc))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, type(self)):
            return False
        return all(_equal(getattr(self, name), getattr(other, name)) for name in self.__slots__)

    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        from minirospy.core.idl.message_text import strify_message

        return strify_message(self)

    __repr__ = __str__


def _equal(value: object, other: object) -> bool:
    """Return whether two field values are equal in genpy's sense: a list equals a tuple with the same items."""
    if type(value) is not type(other) and type(value) in _SEQUENCES and type(other) in _SEQUENCES:
        return tuple(cast("Sequence[object]", value)) == tuple(cast("Sequence[object]", other))
    return bool(value == other)


def number_header(message: protocols.Message, sequence: int) -> None:
    """Set ``seq`` in the header that a message starts with, as rospy does before sending; replace ``frame_id`` None with "0".

    If the header has a wrong type, do nothing: ``serialize`` then raises an error that names the field.
    """
    if is_stamped(message) and is_message(message.header):
        message.header.seq = sequence
        if message.header.frame_id is None:
            message.header.frame_id = "0"


def args_kwds_to_message(data_class: type[_M], args: Sequence[object], kwds: Mapping[str, object]) -> _M:
    """Return the message passed to publish() or a service call, or create one from the field values passed.

    Raise TypeError or AttributeError if the values do not match the fields.
    """
    if args and kwds:
        raise TypeError("publish() can be called with arguments or keywords, but not both.")
    if kwds:
        return data_class(**kwds)
    if not args:
        return data_class()

    if len(args) == 1:
        only = args[0]
        if isinstance(only, data_class) or getattr(only, "_md5sum", None) == data_class._md5sum:
            # Accept a class with the same md5sum from another generator or definition file: its serialized bytes are the same.
            return cast("_M", only)
        if isinstance(only, Message) and len(data_class.__slots__) >= 1 and not _takes(data_class, only):
            raise TypeError(f"expected [{', '.join(data_class._slot_types)}] but got [{only._type}]")
        if isinstance(only, list | tuple) and len(data_class.__slots__) != 1:
            return data_class(*only)

    return data_class(*args)


def _takes(data_class: type[protocols.Message], only: object) -> bool:
    return len(data_class.__slots__) == 1 and data_class._slot_types[0] == getattr(only, "_type", None)
