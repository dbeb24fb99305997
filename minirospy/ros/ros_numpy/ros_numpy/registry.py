"""ros_numpy.registry: the conversion functions, keyed by message type."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from minirospy.core.idl.protocols import Message

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array: TypeAlias = NDArray[Any]  # an array of any type and shape

__all__ = ["converts_from_numpy", "converts_to_numpy", "msgify", "numpify"]

_Function: TypeAlias = Callable[..., object]
_F = TypeVar("_F", bound=_Function)

_to_numpy: dict[tuple[str, bool], _Function] = {}
_from_numpy: dict[tuple[str, bool], _Function] = {}
"""Conversion functions, keyed by (type name, whether they convert lists).

The keys are names because messages read from a bag have other classes.
"""


def converts_to_numpy(msgtype: type[Message], plural: bool = False) -> Callable[[_F], _F]:
    """Return a decorator that registers a converter to arrays from ``msgtype`` (from lists of this type if ``plural``)."""

    def register(function: _F) -> _F:
        _to_numpy[msgtype._type, plural] = function
        return function

    return register


def converts_from_numpy(msgtype: type[Message], plural: bool = False) -> Callable[[_F], _F]:
    """Return a decorator that registers a converter from arrays to ``msgtype`` (to lists of this type if ``plural``)."""

    def register(function: _F) -> _F:
        _from_numpy[msgtype._type, plural] = function
        return function

    return register


def numpify(msg: Any, *args: Any, **kwargs: Any) -> Any:
    """Convert a message or a list of messages to an array; return None for None. Raise ValueError if there is no converter."""
    if msg is None:
        return None
    plural = isinstance(msg, Sequence)
    if plural and not msg:
        raise ValueError("Cannot determine the type of an empty Collection")
    name = getattr(msg[0] if plural else msg, "_type", None)
    function = _to_numpy.get((name or "", plural))
    if function is None:
        raise ValueError(
            f"Unable to convert message {name or type(msg).__name__} - only supports {_known(_to_numpy)}"
        )
    return function(msg, *args, **kwargs)


def msgify(msg_type: type[Any], numpy_obj: Any, *args: Any, plural: bool = False, **kwargs: Any) -> Any:
    """Convert an array to a message, or to a list of messages if ``plural``. Raise ValueError if there is no converter."""
    function = _from_numpy.get((getattr(msg_type, "_type", ""), plural))
    if function is None:
        raise ValueError(
            f"Unable to build message {getattr(msg_type, '_type', msg_type)} - only supports {_known(_from_numpy)}"
        )
    return function(numpy_obj, *args, **kwargs)


def _known(table: dict[tuple[str, bool], _Function]) -> str:
    return ", ".join(f"{name}[]" if plural else name for name, plural in table)
