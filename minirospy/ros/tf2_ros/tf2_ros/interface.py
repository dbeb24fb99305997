"""The base class of the buffer and the buffer client. Transforms whole messages, and converts between types.

Source: http://wiki.ros.org/tf2_ros, http://wiki.ros.org/tf2/Tutorials/Transforming%20your%20own%20datatypes.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any, TypeAlias, TypeVar, overload

from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Header

from minirospy.base import times
from minirospy.client.time import Duration
from minirospy.ros.tf2_ros.tf2_ros.messages import Moment

__all__ = [
    "NO_WAIT",
    "BufferInterface",
    "ConvertRegistration",
    "NotImplementedException",
    "Stamped",
    "TransformRegistration",
    "TypeException",
    "convert",
]

NO_WAIT = Duration()
_A = TypeVar("_A")
_T = TypeVar("_T")
_Function: TypeAlias = Callable[..., Any]


class TypeException(Exception):
    """Raised if no conversion is registered for a type. Import the type's package to register it."""

    def __init__(self, errstr: str) -> None:
        super().__init__(errstr)
        self.errstr = errstr


class NotImplementedException(Exception):
    """Raised if a subclass of BufferInterface does not implement a method that was called."""

    def __init__(self) -> None:
        super().__init__()
        self.errstr = "CanTransform or LookupTransform not implemented"


class _Registry:
    """A process-wide table of functions, keyed by type or by a pair of types."""

    def __init__(self) -> None:
        self.functions: dict[object, _Function] = {}

    def get(self, key: object) -> _Function:
        try:
            return self.functions[key]
        except KeyError:
            raise TypeException(f"Type {key} if not loaded or supported") from None


class TransformRegistration:
    """The functions ``(object, TransformStamped) -> object`` that transform objects of each type, shared by all instances."""

    _registry = _Registry()

    def print_me(self) -> None:
        """Print the registered types."""
        print(self._registry.functions)

    def add(self, key: type[_T], callback: Callable[[_T, TransformStamped], _T]) -> None:
        """Register a function for a type."""
        self._registry.functions[key] = callback

    def get(self, key: type[_T]) -> Callable[[_T, TransformStamped], _T]:
        """Return the function registered for a type. Raise TypeException if no function is registered."""
        return self._registry.get(key)


class ConvertRegistration:
    """The functions that convert between types, directly or through a message, shared by all instances."""

    _to_msg = _Registry()
    _from_msg = _Registry()
    _convert = _Registry()

    def add_from_msg(self, key: type[_T], callback: Callable[..., _T]) -> None:
        """Register the function that converts a message to an object of the type."""
        self._from_msg.functions[key] = callback

    def add_to_msg(self, key: type[_A], callback: Callable[[_A], object]) -> None:
        """Register the function that converts an object of the type to a message."""
        self._to_msg.functions[key] = callback

    def add_convert(self, key: tuple[type[_A], type[_T]], callback: Callable[[_A], _T]) -> None:
        """Register a direct conversion for a pair of types (from, to)."""
        self._convert.functions[key] = callback

    def get_from_msg(self, key: type[_T]) -> Callable[..., _T]:
        """Return the function that converts a message to the type. Raise TypeException if none is registered."""
        return self._from_msg.get(key)

    def get_to_msg(self, key: type[_A]) -> Callable[[_A], object]:
        """Return the function that converts an object of the type to a message. Raise TypeException if none is registered."""
        return self._to_msg.get(key)

    def get_convert(self, key: tuple[type[_A], type[_T]]) -> Callable[[_A], _T]:
        """Return the direct conversion for a pair of types (from, to). Raise TypeException if none is registered."""
        return self._convert.get(key)


def convert(a: object, b_type: type[_T]) -> _T:
    """Convert ``a`` to the type ``b_type``: directly, by copying it, or through a message.

    Raise TypeException if no conversion is registered.
    """
    registration = ConvertRegistration()
    try:
        directly = registration.get_convert((type(a), b_type))
    except TypeException:
        if type(a) is b_type:
            return deepcopy(a)
        to_msg = registration.get_to_msg(type(a))
        return registration.get_from_msg(b_type)(to_msg(a))
    return directly(a)


def Stamped(obj: _T, stamp: times.Time, frame_id: str) -> _T:
    """Set the stamp and frame in an object's ``header``; return the object."""
    obj.header = Header(frame_id=frame_id, stamp=stamp)  # type: ignore[attr-defined]
    return obj


class BufferInterface:
    """Declares the lookup methods, which subclasses implement, and implements the methods that use them."""

    def __init__(self) -> None:
        self.registration = TransformRegistration()

    @overload
    def transform(
        self, object_stamped: _A, target_frame: str, timeout: Moment = NO_WAIT, new_type: None = None
    ) -> _A: ...
    @overload
    def transform(
        self, object_stamped: object, target_frame: str, timeout: Moment = NO_WAIT, *, new_type: type[_T]
    ) -> _T: ...
    @overload
    def transform(
        self, object_stamped: object, target_frame: str, timeout: Moment, new_type: type[_T]
    ) -> _T: ...
    def transform(
        self,
        object_stamped: Any,
        target_frame: str,
        timeout: Moment = NO_WAIT,
        new_type: type | None = None,
    ) -> object:
        """Transform a stamped object to ``target_frame`` at the object's stamp. If ``new_type`` is given, convert the result.

        Raise TypeException if a type is not registered, and the exceptions that :meth:`lookup_transform` raises.
        """
        do_transform = self.registration.get(type(object_stamped))
        header = object_stamped.header
        found = self.lookup_transform(target_frame, header.frame_id, header.stamp, timeout)
        result = do_transform(object_stamped, found)
        return convert(result, new_type) if new_type else result

    def transform_full(
        self,
        object_stamped: Any,
        target_frame: str,
        target_time: Moment,
        fixed_frame: str,
        timeout: Moment = NO_WAIT,
        new_type: type | None = None,
    ) -> Any:
        """Transform a stamped object to ``target_frame`` at ``target_time``.

        ``fixed_frame`` is assumed not to move between the two times. Raise the same exceptions as :meth:`transform`.
        """
        do_transform = self.registration.get(type(object_stamped))
        header = object_stamped.header
        found = self.lookup_transform_full(
            target_frame, target_time, header.frame_id, header.stamp, fixed_frame, timeout
        )
        result = do_transform(object_stamped, found)
        return convert(result, new_type) if new_type else result

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Moment, timeout: Moment = NO_WAIT
    ) -> TransformStamped:
        """Look up a transform; subclasses implement this method."""
        raise NotImplementedException

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Moment,
        source_frame: str,
        source_time: Moment,
        fixed_frame: str,
        timeout: Moment = NO_WAIT,
    ) -> TransformStamped:
        """Look up a transform between two times; subclasses implement this method."""
        raise NotImplementedException

    def can_transform(
        self, target_frame: str, source_frame: str, time: Moment, timeout: Moment = NO_WAIT
    ) -> object:
        """Return whether a transform is available; subclasses implement this method."""
        raise NotImplementedException

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Moment,
        source_frame: str,
        source_time: Moment,
        fixed_frame: str,
        timeout: Moment = NO_WAIT,
    ) -> object:
        """Return whether a transform between two times is available; subclasses implement this method."""
        raise NotImplementedException
