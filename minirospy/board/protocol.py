"""Serialize and parse the messages between a board's server and its clients (msgpack). Pure.

Each message is an array: the number that identifies its kind, then its fields. A client first sends Hello and then
Requests with increasing numbers. The server first sends Welcome (the whole board), and then, on each change, Changed or
PersonMoved to all clients. It sends Done to a client for its finished requests, after the changes that they caused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import msgpack  # type: ignore[import-untyped]

from minirospy.board.model import (
    PINS,
    Force,
    Function,
    Operation,
    Pin,
    Position,
    Press,
    Pull,
    Release,
    Setup,
    Write,
)

__all__ = [
    "VERSION",
    "Changed",
    "Done",
    "Hello",
    "Message",
    "MovePerson",
    "PersonMoved",
    "ProtocolError",
    "Refused",
    "Request",
    "Stream",
    "Welcome",
    "decode_board",
    "encode_board",
    "serialize",
]

VERSION = 2
_MAX_BUFFER = 1 << 20


class ProtocolError(ValueError):
    """The bytes are not a message of this protocol."""


class Hello(NamedTuple):
    """A client's first message; ``token`` is a TCP server's secret, or "" on a Unix socket."""

    version: int
    token: str


class MovePerson(NamedTuple):
    """An operation that moves the person to a position; None removes the person."""

    position: Position | None


class Request(NamedTuple):
    """A request to perform ``operation``. If that is None, the request only asks for a Done in reply."""

    number: int
    operation: Operation | MovePerson | None


class Welcome(NamedTuple):
    """The server's first message: every pin, and the person's position."""

    version: int
    pins: list[Pin]
    person: Position | None


class Changed(NamedTuple):
    """A pin changed at ``time`` (Unix seconds); ``edge`` is true if its level changed."""

    pin: int
    state: Pin
    edge: bool
    time: float


class PersonMoved(NamedTuple):
    """The person is now at ``position``."""

    position: Position | None


class Done(NamedTuple):
    """All requests up to ``number`` have been executed."""

    number: int


class Refused(NamedTuple):
    """Request ``number`` was refused and changed nothing; ``why`` is the reason."""

    number: int
    why: str


Message = Hello | Request | Welcome | Changed | Done | Refused | PersonMoved

_KINDS: tuple[type[Message], ...] = (Hello, Request, Welcome, Changed, Done, Refused, PersonMoved)
_OPERATIONS: tuple[Callable[..., Operation | MovePerson], ...] = (
    Setup,
    Write,
    Press,
    Release,
    Force,
    MovePerson,
)
_KIND_NUMBER = {kind: number for number, kind in enumerate(_KINDS)}
_OPERATION_NUMBER = {kind: number for number, kind in enumerate(_OPERATIONS)}


def serialize(message: Message) -> bytes:
    """Serialize one message."""
    fields: tuple[object, ...] = message
    if isinstance(message, Request):
        operation = message.operation
        packed = None if operation is None else (_OPERATION_NUMBER[type(operation)], *operation)
        fields = (message.number, packed)
    encoded: bytes = msgpack.packb((_KIND_NUMBER[type(message)], *fields))
    return encoded


class Stream:
    """A decoder that turns bytes received on a connection into messages."""

    def __init__(self) -> None:
        self._unpacker = msgpack.Unpacker(use_list=False, max_buffer_size=_MAX_BUFFER)

    def feed(self, data: bytes) -> Iterator[Message]:
        """Yield the messages that ``data`` completes. Raise ProtocolError if the data is invalid."""
        try:
            self._unpacker.feed(data)
            for item in self._unpacker:
                yield _message(item)
        except (ValueError, TypeError, LookupError, msgpack.exceptions.UnpackException) as error:
            raise ProtocolError(f"not a message of a board: {error}") from error


def encode_board(pins: list[Pin], person: Position | None) -> bytes:
    """Serialize a board to the bytes stored in its file."""
    return serialize(Welcome(VERSION, pins, person))


def decode_board(block: bytes) -> tuple[list[Pin], Position | None]:
    """Parse the pins and the person serialized by :func:`encode_board`. Raise ProtocolError if the block is invalid."""
    messages = list(Stream().feed(block))
    if len(messages) != 1 or not isinstance(messages[0], Welcome) or messages[0].version != VERSION:
        raise ProtocolError("not a saved board")
    return messages[0].pins, messages[0].person


def _message(item: Sequence[object]) -> Message:
    return _READERS[_natural(item[0])](*item[1:])


def _request(number: object, item: Sequence[object] | None) -> Request:
    if item is None:
        return Request(_natural(number), None)
    operation = _OPERATIONS[_natural(item[0])](*item[1:])
    if isinstance(operation, Write):
        operation = Write(tuple((pin, level) for pin, level in operation.levels))
    elif isinstance(operation, MovePerson):
        operation = MovePerson(_position(operation.position))
    return Request(_natural(number), operation)


def _welcome(
    version: object, items: Iterable[tuple[int, int, object, object]], person: Sequence[float] | None = None
) -> Welcome:
    pins = [_pin(*item) for item in items]
    if len(pins) != PINS:
        raise ProtocolError(f"{len(pins)} pins instead of {PINS}")
    return Welcome(_natural(version), pins, _position(person))


def _position(item: Sequence[float] | None) -> Position | None:
    if item is None:
        return None
    ahead, left = item
    return float(ahead), float(left)


def _pin(function: int, pull: int, world: object, latch: object) -> Pin:
    return Pin(Function(function), Pull(pull), None if world is None else int(bool(world)), int(bool(latch)))


def _natural(item: object) -> int:
    if not isinstance(item, int) or item < 0:
        raise ProtocolError(f"{item!r} is not a number from 0")
    return item


_READERS: tuple[Callable[..., Message], ...] = (
    lambda version, token: Hello(_natural(version), str(token)),
    _request,
    _welcome,
    lambda pin, state, edge, time: Changed(_natural(pin), _pin(*state), bool(edge), float(time)),
    lambda number: Done(_natural(number)),
    lambda number, why: Refused(_natural(number), str(why)),
    lambda position: PersonMoved(_position(position)),
)  # functions that create a message from its fields, in the order of _KINDS
