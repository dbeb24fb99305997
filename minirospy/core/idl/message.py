"""The base of generated messages: the base class, checks, formatting a message as text, and filling it from values.

The names and rules are genpy's, because user code relies on them: http://docs.ros.org/api/genpy/html/.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple, TextIO, TypeVar, cast

from minirospy.base.errors import (
    DefinitionError,
    DeserializationError,
    MessageException,
    SerializationError,
)
from minirospy.base.notes import noted
from minirospy.base.times import Duration, Time, TVal
from minirospy.core.idl.protocols import is_message, is_stamped

if TYPE_CHECKING:
    from minirospy.core.idl import protocols
    from minirospy.core.idl.protocols import Buffer, Writer

__all__ = [
    "DeserializationError",
    "Message",
    "MessageException",
    "SerializationError",
    "args_kwds_to_message",
    "check_type",
    "fill_message_args",
    "get_printable_message_args",
    "number_header",
    "strify_message",
]

_M = TypeVar("_M", bound="protocols.Message")

_INTEGERS = {
    **{f"int{bits}": (-(2 ** (bits - 1)), 2 ** (bits - 1)) for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": (0, 2**bits) for bits in (8, 16, 32, 64)},
    "byte": (-128, 128),
    "char": (0, 256),
}
_SEQUENCES = (list, tuple)
# roslib/Header is the type's name in packages from before 2011.
_HEADER_TYPES = ("std_msgs/Header", "roslib/Header")
_TIME_SLOTS = ["secs", "nsecs"]
_PLAIN = re.compile(r"[A-Za-z_/][A-Za-z0-9_/.]*", re.ASCII)
_NOT_PLAIN = {"y", "n", "yes", "no", "on", "off", "true", "false", "null"}
# YAML folds strings of at least this length if they contain spaces.
_FOLDED = 76


class _Options(NamedTuple):
    """The options of :func:`strify_message`."""

    time_offset: Time | None
    current_time: object
    field_filter: Callable[[protocols.Message], Sequence[str]] | None
    width: int | None


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
        # If ``exc`` is given, find the field that cannot be written. Otherwise check everything that genpy checks.
        checks = _STRICT_CHECKS if exc is None else _CHECKS
        for name, type_ in zip(self.__slots__, self._get_types(), strict=True):
            _check_field(name, type_, getattr(self, name), checks)
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


def check_type(field_name: str, field_type: str, field_val: object) -> None:
    """Raise SerializationError unless the value is valid for a field of this type (``int8``, ``string[]``, ``pkg/Name``).

    Like genpy, reject bools as numbers and non-ASCII strings, although both can be sent.
    """
    _check_field(field_name, field_type, field_val, _STRICT_CHECKS)


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


def get_printable_message_args(msg: protocols.Message, buff: TextIO | None = None, prefix: str = "") -> str:
    """Return the names of a message's fields in order, nested fields as ``a.b``. If ``buff`` is given, also write them to it."""
    found: list[str] = []

    def walk(current: protocols.Message, path: str) -> None:
        for name in current.__slots__:
            value = getattr(current, name)
            if is_message(value) and not isinstance(value, TVal):
                walk(value, f"{path}{name}.")
            else:
                found.append(path + name)

    walk(msg, prefix)
    if buff is not None:
        buff.write("".join(f"{name} " for name in found))
    return " ".join(found)


def strify_message(
    val: object,
    indent: str = "",
    time_offset: Time | None = None,
    current_time: object = None,
    field_filter: Callable[[protocols.Message], Sequence[str]] | None = None,
    fixed_numeric_width: int | None = None,
) -> str:
    """Return a value as YAML text, in the format that `rostopic echo` prints.

    ``field_filter`` selects the fields of a message; ``fixed_numeric_width`` pads numbers to that width;
    ``time_offset`` is subtracted from times.
    """
    if isinstance(val, bool) or val is None:
        return str(val)
    if isinstance(val, int | float):
        return _number(val, fixed_numeric_width)
    if isinstance(val, str):
        return _quoted(val) if val else "''"
    if isinstance(val, TVal):
        return _time_text(val, indent, time_offset, fixed_numeric_width)
    if isinstance(val, bytes | bytearray | memoryview):
        return str(val)

    options = _Options(time_offset, current_time, field_filter, fixed_numeric_width)
    if isinstance(val, list | tuple):
        return _list_text(val, indent, options)
    if hasattr(val, "tolist"):
        return _list_text(val.tolist(), indent, options)
    if is_message(val):
        return _message_text(val, indent, options)
    return str(val)


# --- text


def _message_text(message: protocols.Message, indent: str, options: _Options) -> str:
    field_filter = options.field_filter
    names = field_filter(message) if field_filter else message.__slots__
    types = dict(zip(message.__slots__, message._slot_types, strict=True))
    lines = []
    for name in names:
        value = getattr(message, name)
        type_ = types[name]
        if type_.startswith("uint8[") and isinstance(value, bytes | bytearray | memoryview):
            # Show bytes as numbers; genpy leaves a char[] unchanged.
            value = list(value)
        elif type_.startswith("uint8[") and isinstance(value, str):
            value = [ord(letter) for letter in value]
        lines.append(f"{indent}{name}: {strify_message(value, indent + '  ', *options)}")
    text = "\n".join(lines)
    return "\n" + text if indent else text


def _list_text(values: Sequence[object], indent: str, options: _Options) -> str:
    if not values:
        return "[]"
    first = values[0]
    if isinstance(first, int | float):
        width = None if isinstance(first, bool) else options.width
        return "[" + ", ".join(_number_or_text(value, width) for value in values) + "]"
    if isinstance(first, str):
        return "".join(f"\n{indent}{line}" for line in _items(values))
    inner = indent + "  "
    return "".join(f"\n{indent}- {strify_message(value, inner, *options)}" for value in values)


def _time_text(value: TVal, indent: str, offset: Time | None, width: int | None) -> str:
    if offset is not None and isinstance(value, Time):
        value = value - offset
    seconds = value.secs if width is None else _integer(value.secs, width)
    return f"\n{indent}secs: {seconds}\n{indent}nsecs: {_integer(value.nsecs, width or 9)}"


def _integer(number: float, width: int) -> str:
    # Format with %, because programs store floats in times, as in `stamp.secs = time.time()`.
    return "%*d" % (width, number)  # noqa: UP031 - format() refuses floats


def _number(value: object, width: int | None) -> str:
    if width is None or isinstance(value, bool):
        return str(value)
    if isinstance(value, float):
        text = f"{value:.{width}f}"
        return text[: max(width, text.find("."))]
    return f"{value:{width}d}"


def _number_or_text(value: object, width: int | None) -> str:
    """Format an item. The list's first item is a number, but the list may also contain strings."""
    if isinstance(value, str):
        return repr(value) if width is None else _quoted(value)
    if value is None:
        return "None"
    return _number(value, width)


def _quoted(text: str) -> str:
    if len(text) < _FOLDED and text.isascii() and text.isprintable() and '"' not in text and "\\" not in text:
        return f'"{text}"'
    import yaml

    return str(yaml.dump(text, default_style='"')).rstrip("\n")


def _items(texts: Sequence[object]) -> list[str]:
    """Return the YAML lines for a list of strings."""
    if all(
        isinstance(text, str) and _PLAIN.fullmatch(text) and text.lower() not in _NOT_PLAIN for text in texts
    ):
        return [f"- {text}" for text in texts]
    import yaml

    return str(yaml.dump(list(texts))).rstrip("\n").splitlines()


# --- checks


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


# --- filling


def _takes(data_class: type[protocols.Message], only: object) -> bool:
    return len(data_class.__slots__) == 1 and data_class._slot_types[0] == getattr(only, "_type", None)


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
    if base in _CHECKS:
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
