"""Messages as YAML text, in genpy's format, which `rostopic echo` prints: http://docs.ros.org/api/genpy/html/."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, TextIO

from minirospy.base.times import Time, TVal
from minirospy.core.idl.protocols import is_message

if TYPE_CHECKING:
    from minirospy.core.idl import protocols

__all__ = ["get_printable_message_args", "strify_message"]

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
