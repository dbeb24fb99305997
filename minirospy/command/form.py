"""A form on the terminal for a message: a prompt per field, with the field's value as the default.

The user's input is YAML.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from typing import NamedTuple, TypeVar

from minirospy.base.errors import MessageException, ValueTextError
from minirospy.core.idl.protocols import Message, is_message
from minirospy.introspect.messages import check, fill
from minirospy.introspect.values import parse_value

__all__ = ["Field", "ask_for", "fields", "flow"]

_M = TypeVar("_M", bound=Message)


class Field(NamedTuple):
    """A field to prompt for: its path (``pose.position.x``), type and value."""

    path: str
    type: str
    value: object


def fields(message: Message, prefix: str = "") -> Iterator[Field]:
    """Yield the fields of a message and of its nested messages; an array, a time or a duration is a single field."""
    for name, type_ in zip(message.__slots__, message._slot_types, strict=True):
        value = getattr(message, name)
        if is_message(value):
            yield from fields(value, f"{prefix}{name}.")
        else:
            yield Field(prefix + name, type_, value)


def ask_for(
    message: _M,
    ask: Callable[[str], str],
    complain: Callable[[Exception], None],
    known: Collection[str] = (),
) -> _M:
    """Prompt the user for each field of ``message``, and return the filled message. Empty input keeps a field's value.

    Skip the top-level fields in ``known``.

    ``ask(question)`` returns the input. If the input is invalid, call ``complain(error)``, which may raise, and prompt
    again.
    """
    for field in list(fields(message)):
        if field.path.partition(".")[0] in known:
            continue
        answer = ask(_question(field)).strip()
        while answer:
            try:
                # Try the value on another message first, so that ``message`` never holds an invalid value.
                values = _nested(field.path, _value(field, answer))
                check(fill(type(message)(), [values]))
            except (MessageException, ValueTextError) as error:
                complain(error)
                answer = ask(_question(field)).strip()
            else:
                fill(message, [values])
                break
    return message


def flow(value: object) -> str:
    """Format a value as YAML on one line."""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, bytes | list | tuple):
        return "[" + ", ".join(flow(each) for each in value) + "]"
    if is_message(value):
        inner = (f"{name}: {flow(getattr(value, name))}" for name in value.__slots__)
        return "{" + ", ".join(inner) + "}"
    if hasattr(value, "secs") and hasattr(value, "nsecs"):
        return f"{{secs: {value.secs}, nsecs: {value.nsecs}}}"
    return str(value) if value != "" else "''"


def _question(field: Field) -> str:
    return f"{field.path} ({field.type}) [{flow(field.value)}]: "


def _value(field: Field, answer: str) -> object:
    """Parse the user's input for a field. A string needs no quotes."""
    if field.type == "string" and answer[0] not in "'\"":
        return answer
    return parse_value(answer)


def _nested(path: str, value: object) -> object:
    """Nest a value in dictionaries: the path ``a.b`` gives {a: {b: value}}."""
    for name in reversed(path.split(".")):
        value = {name: value}
    return value
