"""Find message classes by name or connection header; fill messages from YAML, serialize and deserialize them.

Classes of types that are not installed are generated from the definition in the publisher's connection header.
"""

from __future__ import annotations

import itertools
from io import BytesIO
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from minirospy.base.errors import MessageException, NotFoundError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from minirospy.core.idl.protocols import Message
    from minirospy.core.wire.header import Header

__all__ = ["MessageClasses", "Received", "check", "fill", "serialize", "words_of"]

_MAX_CLASSES = 256
_M = TypeVar("_M", bound="Message")


_HINTS = {
    # YAML may parse an unquoted string as another type, for example 5 as a number, and 1e-3 as a string.
    "an ascii string": ", a text that could be a number, a date or a list needs its own quotes: \"'5'\"",
    "must be float type": ", numbers like 1.0e-3, .inf and .nan with their dot",
}


class Received(NamedTuple):
    """A received message: its bytes, its publisher's connection header, and its receive time in ns since the epoch."""

    body: bytes
    header: Header
    nanoseconds: int

    @property
    def time(self) -> float:
        """Return the receive time in seconds since the epoch."""
        return self.nanoseconds / 1e9


class MessageClasses:
    """The classes of received messages. Each class is looked up or generated only once."""

    def __init__(self) -> None:
        self._classes: dict[tuple[str, str], type[Message]] = {}

    def for_header(self, header: Mapping[str, str]) -> type[Message]:
        """Return the class for a publisher's connection header: the installed class or, if its md5sum differs, a generated one.

        Raise NotFoundError if the type is not installed and the publisher sent no definition, or DefinitionError if the
        definition cannot be parsed.
        """
        key = (header.get("type", "*"), header.get("md5sum", "*"))
        if key not in self._classes:
            if len(self._classes) >= _MAX_CLASSES:
                # No normal program uses this many types, so a publisher must be sending made-up type names.
                self._classes.clear()
            self._classes[key] = self._find(*key, header.get("message_definition", ""))
        return self._classes[key]

    def read(self, received: Received) -> Message:
        """Deserialize a received message.

        Raise DeserializationError if its bytes are invalid, or the exceptions of :meth:`for_header` if there is no class
        for it.
        """
        message = self.for_header(received.header)()
        message.deserialize(received.body)
        message._connection_header = received.header
        return message

    @staticmethod
    def _find(type_: str, md5sum: str, definition: str) -> type[Message]:
        from minirospy.core.idl.load import class_from_text, get_message_class

        installed = get_message_class(type_)
        if installed is not None and md5sum in ("*", installed._md5sum):
            return installed
        if definition or installed is not None:
            return class_from_text(type_, definition)
        raise NotFoundError(
            "message type", type_, hint="it is not installed, and its publisher sent no definition"
        )


def fill(message: _M, values: Sequence[object], keys: Mapping[str, object] | None = None) -> _M:
    """Set the fields of ``message`` from YAML values: one dictionary, or one value per field in order.

    Return the message. ``keys`` maps words to the values that they represent, such as ``now`` to a time. Raise
    MessageException if the values do not match the fields.
    """
    from minirospy.core.idl.fill_message import fill_message_args

    # Without values, the message keeps its defaults.
    try:
        fill_message_args(message, list(values) or [{}], keys=dict(keys or {}))
    except (MessageException, ValueError, TypeError, AttributeError) as error:
        raise _does_not_fit(message, error, values) from error
    return message


def words_of(nanoseconds: int) -> dict[str, object]:
    """Return the values of the keywords ``now`` (this time) and ``auto`` (a header with this time as its stamp)."""
    from minirospy.base.times import Time
    from minirospy.core.idl.load import get_message_class

    now = Time(*divmod(nanoseconds, 10**9))
    header = get_message_class("std_msgs/Header")
    return {"now": now} if header is None else {"now": now, "auto": header(stamp=now)}


def check(message: Message) -> None:
    """Raise MessageException, which names the field, if a value does not match the definition."""
    serialize(message)


def serialize(message: Message) -> bytes:
    """Serialize a message. Raise MessageException if a value does not match its field."""
    buffer = BytesIO()
    try:
        message.serialize(buffer)
    except (MessageException, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise _does_not_fit(message, error) from error
    return buffer.getvalue()


def _does_not_fit(message: Message, error: Exception, values: Sequence[object] = ()) -> MessageException:
    """Return a one-line error saying that ``values``, entered by the user, do not match the message, and listing its fields."""
    fields = zip(message.__slots__, message._slot_types, strict=True)
    shown = ", ".join(f"{type_} {name}" for name, type_ in fields) or "no fields"
    why = " ".join(str(error).split())
    hint = next((hint for words, hint in _HINTS.items() if words in why), "")
    if len(values) > 1 and isinstance(values[0], dict):
        hint = ', quotes belong around the whole of a message, as in "data: True"'
    words = [*values, *(getattr(message, name, None) for name in message.__slots__)]
    words += itertools.chain(*(value for value in values if isinstance(value, dict)))
    for word in words:
        name, colon, rest = word.partition(":") if isinstance(word, str) else ("", "", "")
        if colon and name in message.__slots__ and not rest.startswith(" "):
            hint = f', behind the colon of "{name}:" belongs a blank'
    return MessageException(f"{why}{hint} ([{message._type}] has {shown})")
