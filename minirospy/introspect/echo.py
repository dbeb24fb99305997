"""Format messages as `rostopic echo` does, and fill messages for `rostopic pub`. Pure."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, cast

from minirospy.base.errors import UsageError
from minirospy.base.times import Time
from minirospy.core.idl.protocols import is_message, is_stamped
from minirospy.introspect.fields import Report, field_type, field_value, parse_path
from minirospy.introspect.messages import MessageClasses, fill, serialize, words_of
from minirospy.introspect.plot import plot_header, plot_row

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message
    from minirospy.introspect.messages import Received
    from minirospy.introspect.topics import TopicField

__all__ = ["Echo", "Filter", "elided", "fill_message"]


class Filter:
    """A Python expression over a message ``m`` and its ``topic``, entered by the user."""

    def __init__(self, expression: str) -> None:
        """Compile the expression. Raise UsageError if its syntax is invalid."""
        self._expression = expression
        try:
            self._code = compile(expression, "--filter", "eval")
        except (SyntaxError, ValueError) as error:
            raise UsageError(f"filter [{expression}] is not a Python expression: {error}") from error

    def __call__(self, message: Message, topic: str) -> bool:
        """Return whether the expression is true for a message. Raise UsageError if it cannot be evaluated."""
        try:
            # eval is safe here: users run their own code on their own machine, as in ROS.
            return bool(eval(self._code, {"m": message, "topic": topic}))
        # The user's expression may raise any exception, which is reported to the user.
        except Exception as error:
            raise UsageError(f"filter [{self._expression}]: {type(error).__name__}: {error}") from error


class Echo:
    """Formats a topic's messages, or one field of them, as output lines that end with a line feed.

    ``plot``: print comma-separated values, with a header line first. ``strings`` and ``arrays``: show fields of these
    kinds. ``width``: the width of numbers. ``offset``: show times as differences from ``now()``, which returns
    nanoseconds. ``header_times``: in a plot, use the time in a message's header, if it has one, instead of the receive
    time. ``report`` is called with the error for each element of a slice that lacks the rest of the path; the element is
    shown as null. ``is_type_known``: False for bags, where ROS does not look up the type of a field that is not a
    message.
    """

    def __init__(
        self,
        field: TopicField,
        *,
        plot: bool = False,
        strings: bool = True,
        arrays: bool = True,
        width: int | None = None,
        offset: bool = False,
        now: Callable[[], int] = time.time_ns,
        header_times: bool = True,
        is_type_known: bool = True,
        report: Report = lambda _: None,
    ) -> None:
        self._path = field.path
        self._steps = parse_path(field.path)
        self._plot = plot
        self._strings = strings
        self._arrays = arrays
        self._width = width
        self._offset = offset
        self._now = now
        self._header_times = header_times
        self._is_type_known = is_type_known
        self._report = report

        self._type = ""
        self._classes = MessageClasses()
        self._checked: type[Message] | None = None
        self._header_written = False

    def message(self, received: Received) -> Message:
        """Deserialize a message; return it or its selected field.

        Raise NotFoundError if the message has no such field.
        """
        from minirospy.core.idl.load import get_message_class

        message = self._classes.read(received)
        if type(message) is not self._checked:
            self._checked = type(message)
            if get_message_class(message._type) is type(message):
                self._type = field_type(type(message), self._path)
        return message

    def text(self, message: Message, received: Received) -> str:
        """Return the output for a message. Raise IndexError if the path's index is beyond the end of an array."""
        value = field_value(message, self._steps, self._report)
        return self._row(value, received) if self._plot else self._block(value)

    def _row(self, value: object, received: Received) -> str:
        origin = self._now() if self._offset else 0
        stamp = received.nanoseconds
        if self._header_times and is_stamped(value):
            stamp = value.header.stamp.to_nsec()
        strings, arrays = (True, True) if self._is_shown_whole(value) else (self._strings, self._arrays)
        header = ""
        if not self._header_written:
            self._header_written = True
            header = plot_header(value, strings=strings, arrays=arrays) + "\n"
        row = plot_row(value, stamp - origin, strings=strings, arrays=arrays, origin=origin)
        return header + row + "\n"

    def _is_shown_whole(self, value: object) -> bool:
        """Return whether to print a value completely, without eliding strings or arrays.

        This applies to a field of a bag's message that is not itself a message, because ROS does not look up its type.
        """
        return not self._is_type_known and not is_message(value)

    def _block(self, value: object) -> str:
        from minirospy.core.idl.message_text import strify_message

        if self._is_shown_whole(value):
            return strify_message(value, fixed_numeric_width=self._width) + "\n---\n"

        # Like ROS, print a char[] field as bytes. Print uint8[], on which ROS fails, as a list.
        if isinstance(value, bytes) and not self._type.startswith("char"):
            value = list(value)
        if not (self._strings and self._arrays):
            value = elided(value, self._type, self._strings, self._arrays)
        now = Time(*divmod(self._now(), 10**9)) if self._offset else None
        return strify_message(value, time_offset=now, fixed_numeric_width=self._width) + "\n---\n"


def fill_message(cls: type[Message], values: Sequence[object], nanoseconds: int | None = None) -> Message:
    """Create a message, with its fields set from YAML values.

    ``now`` represents ``nanoseconds`` (or the current time), ``auto`` a stamped header. Raise MessageException, with the
    names of the fields, if the values do not match the fields.
    """
    message = fill(cls(), values, words_of(time.time_ns() if nanoseconds is None else nanoseconds))
    serialize(message)
    return message


def elided(value: object, type_: str, strings: bool, arrays: bool) -> object:
    """Return ``value`` with placeholders in place of strings or arrays. ``type_`` is its ROS type, or "" if unknown.

    As in ROS, arrays of messages are not elided, the placeholder of a fixed-length array contains the length, as in ``[3``,
    and a field's values from all elements of an array are treated as a single value of the field's type.
    """
    if type_ == "string" and isinstance(value, list):
        return value if strings else f"<string length: {len(value)}>"
    if type_.endswith("]") or (isinstance(value, list | tuple) and not type_):
        values = cast("Sequence[object]", value)
        if not arrays or (type_.startswith("string[") and not strings):
            return f"<array type: {type_.rstrip('[]')}, length: {len(values)}>"
        return value

    if isinstance(value, str):
        return value if strings else f"<string length: {len(value)}>"
    if not is_message(value):
        return value
    cls = type(value)
    fields = {
        name: elided(getattr(value, name), slot_type, strings, arrays)
        for name, slot_type in zip(cls.__slots__, cls._slot_types, strict=True)
    }
    # A field is printed according to its declared type, but a placeholder is always a string.
    types = tuple(
        "string" if isinstance(fields[name], str) else slot_type
        for name, slot_type in zip(cls.__slots__, cls._slot_types, strict=True)
    )
    shown = object.__new__(_class_with_types(cls, types))
    for name, field in fields.items():
        setattr(shown, name, field)
    return shown


@lru_cache(maxsize=256)
def _class_with_types(cls: type[Message], types: tuple[str, ...]) -> type[Message]:
    return type(cls.__name__, cls.__bases__, {"__slots__": cls.__slots__, "_slot_types": list(types)})
