"""Fill messages from values that were parsed from YAML, as `rostopic pub` and `rosservice call` do, by genpy's rules."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from minirospy.base.errors import DefinitionError, MessageException
from minirospy.base.times import Duration, Time, TVal
from minirospy.core.idl.field_checks import BUILTIN_TYPES
from minirospy.core.idl.protocols import is_message

if TYPE_CHECKING:
    from minirospy.core.idl import protocols

__all__ = ["fill_message_args"]

_TIME_SLOTS = ["secs", "nsecs"]


def fill_message_args(msg: object, msg_args: object, keys: Mapping[str, object] | None = None) -> None:
    """Fill ``msg`` from values parsed from YAML: a list of its field values, or a list with one dictionary of them.

    ``keys`` are words that represent values ("now", "auto"). Raise MessageException if a name or the number
    of values does not match, ValueError if a value cannot be assigned to its field.
    """
    if not is_message(msg) or isinstance(msg, type):
        raise ValueError(f"msg must be a Message instance: {msg}")
    words = keys or {}
    if msg_args is None:
        msg_args = []

    if isinstance(msg_args, dict):
        msg_args = [msg_args] if msg_args else [{}]
    elif not isinstance(msg_args, list | tuple):
        raise ValueError(f"invalid msg_args type: {msg_args}")

    if len(msg_args) == 1 and isinstance(msg_args[0], dict):
        _fill(msg, msg_args[0], words, "")
    elif len(msg_args) == 1 and msg_args[0] is None and not msg.__slots__:
        return
    else:
        _fill(msg, list(msg_args), words, "")


def _fill(message: protocols.Message, values: object, words: Mapping[str, object], path: str) -> None:
    if isinstance(values, dict):
        types = dict(zip(message.__slots__, message._slot_types, strict=True))
        for name, value in values.items():
            if name not in types:
                raise MessageException(f"No field name [{path}{name}]")
            # YAML parses a key without a value as null, but the user means the empty string.
            _fill_field(message, name, types[name], "" if value is None else value, words, path)
        return
    if not isinstance(values, list | tuple):
        raise ValueError(f"invalid msg_args type: {values}")
    if len(values) != len(message.__slots__):
        raise _wrong_number(values, message.__slots__)
    for name, type_, value in zip(message.__slots__, message._slot_types, values, strict=True):
        _fill_field(message, name, type_, value, words, path)


def _fill_field(
    message: protocols.Message, name: str, type_: str, value: object, words: Mapping[str, object], path: str
) -> None:
    current = getattr(message, name)
    if isinstance(current, TVal):
        setattr(message, name, _filled_time(current, value, words, f"{path}{name}."))
    elif is_message(current):
        if isinstance(value, str):
            setattr(message, name, _word(value, words))
        else:
            _fill(current, value, words, f"{path}{name}.")
    elif type_.endswith("]"):
        setattr(message, name, _filled_array(message, name, type_, value, words, path))
    else:
        setattr(message, name, value)


def _filled_array(
    message: protocols.Message, name: str, type_: str, values: object, words: Mapping[str, object], path: str
) -> object:
    base, _, length = type_.removesuffix("]").partition("[")
    if isinstance(values, bytes) and base in ("uint8", "char"):
        return values
    if not isinstance(values, list | tuple):
        raise MessageException(
            f"Field [{path}{name}] must be a list or tuple instead of: {type(values).__name__}"
        )
    if length and len(values) != int(length):
        raise MessageException(
            f"Field [{path}{name}] has incorrect number of elements: {len(values)} != {length}"
        )
    if base in ("time", "duration"):
        kind = Time if base == "time" else Duration
        return [_filled_time(kind(), value, words, "") for value in values]
    if base in BUILTIN_TYPES:
        return list(values)
    element_class = _element_class(message, base)
    if element_class is None:
        raise MessageException(
            f"Cannot instantiate messages for field [{path}{name}] : cannot load class {base}"
        )
    filled = []
    for value in values:
        element = element_class()
        # In genpy's errors, the path starts at the element.
        _fill(element, value, words, "")
        filled.append(element)
    return filled


def _element_class(message: protocols.Message, type_: str) -> type[protocols.Message] | None:
    """Return the installed class of an array's elements, else the one from the message's full text, else None."""
    from minirospy.core.idl.load import classes_from_text, get_message_class

    found = get_message_class(type_)
    if found is not None:
        return found
    try:
        # Messages from a bag or peer are created from this text; their packages need not be installed.
        return classes_from_text(message._type, message._full_text).get(type_)
    except DefinitionError:
        return None


def _filled_time(current: TVal, value: object, words: Mapping[str, object], path: str) -> object:
    match value:
        case str():
            return _word(value, words)
        case dict() if unknown := [name for name in value if name not in _TIME_SLOTS]:
            raise MessageException(f"No field name [{path}{unknown[0]}]")
        case dict() if not value:
            return current
        case {"secs": int(secs), "nsecs": int(nsecs)}:
            return type(current)(secs, nsecs)
        case {"secs": int(secs), **others} if not others:
            return type(current)(secs, current.nsecs)
        case {"nsecs": int(nsecs), **others} if not others:
            return type(current)(current.secs, nsecs)
        case list() | tuple() if len(value) != len(_TIME_SLOTS):
            raise _wrong_number(value, _TIME_SLOTS)
        case [int(secs), int(nsecs)]:
            return type(current)(secs, nsecs)
        case bool():
            pass
        case int():
            # As in genpy, interpret a plain number as nanoseconds.
            return type(current)(0, value)
        case TVal():
            return value

    raise ValueError(f"invalid msg_args type: {value}")


def _wrong_number(values: Sequence[object], names: Sequence[str]) -> MessageException:
    what = "Too many" if len(values) > len(names) else "Not enough"
    return MessageException(f"{what} arguments:\n * Given: {list(values)}\n * Expected: {list(names)}")


def _word(word: str, words: Mapping[str, object]) -> object:
    if word not in words:
        raise MessageException(f"No key named [{word}]")
    return words[word]
