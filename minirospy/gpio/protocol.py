"""Messages between a board's server and its clients <-> bytes (msgpack). Pure.

Each message is an array: its kind's number, then its fields. A client opens with Hello and then sends
Requests, numbered upwards; the server opens with Welcome (all pins), sends Changed to everybody when pins
change, and Done to a client for the requests it carried out, after the Changed that they caused.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import msgpack

from minirospy.gpio.model import (
    PINS,
    Force,
    Function,
    Operation,
    OperationError,
    Pin,
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
    "ProtocolError",
    "Refused",
    "Request",
    "Stream",
    "Welcome",
    "decode_pins",
    "encode_pins",
    "serialize",
]

VERSION = 1
_MAX_BUFFER = 1 << 20


class ProtocolError(ValueError):
    """Bytes that are not a message of this protocol."""


class Hello(NamedTuple):
    """A client's first message; ``token`` is the secret of a TCP server, "" on a Unix socket."""

    version: int
    token: str


class Request(NamedTuple):
    """Carry ``operation`` out; None asks only for the Done."""

    number: int
    operation: Operation | None


class Welcome(NamedTuple):
    """The server's first message: every pin."""

    version: int
    pins: list[Pin]


class Changed(NamedTuple):
    """A pin changed at ``time`` (Unix seconds); ``edge`` says whether its level did."""

    pin: int
    state: Pin
    edge: bool
    time: float


class Done(NamedTuple):
    """Every request up to ``number`` is carried out."""

    number: int


class Refused(NamedTuple):
    """Request ``number`` changed nothing, because of ``why``."""

    number: int
    why: str


Message = Hello | Request | Welcome | Changed | Done | Refused

_KINDS: tuple[type[Message], ...] = (Hello, Request, Welcome, Changed, Done, Refused)
_OPERATIONS: tuple[type[Operation], ...] = (Setup, Write, Press, Release, Force)
_KIND_NUMBER = {kind: number for number, kind in enumerate(_KINDS)}
_OPERATION_NUMBER = {kind: number for number, kind in enumerate(_OPERATIONS)}


def serialize(message: Message) -> bytes:
    """The bytes of one message."""
    fields: tuple[object, ...] = message
    if isinstance(message, Request):
        operation = message.operation
        packed = None if operation is None else (_OPERATION_NUMBER[type(operation)], *operation)
        fields = (message.number, packed)
    encoded: bytes = msgpack.packb((_KIND_NUMBER[type(message)], *fields))
    return encoded


class Stream:
    """Bytes in, messages out, of one direction of one connection."""

    def __init__(self) -> None:
        self._unpacker = msgpack.Unpacker(use_list=False, max_buffer_size=_MAX_BUFFER)

    def feed(self, data: bytes) -> Iterator[Message]:
        """The messages that ``data`` completes; raises ProtocolError."""
        try:
            self._unpacker.feed(data)
            for item in self._unpacker:
                yield _message(item)
        except (ValueError, TypeError, IndexError, msgpack.exceptions.UnpackException) as error:
            raise ProtocolError(f"not a message of a board: {error}") from error


def encode_pins(pins: list[Pin]) -> bytes:
    """All pins as one block, for the file that keeps them."""
    return serialize(Welcome(VERSION, pins))


def decode_pins(block: bytes) -> list[Pin]:
    """The pins of :func:`encode_pins`; raises ProtocolError."""
    messages = list(Stream().feed(block))
    if len(messages) != 1 or not isinstance(messages[0], Welcome) or messages[0].version != VERSION:
        raise ProtocolError("not the pins of a board")
    return messages[0].pins


def _message(item: tuple[object, ...]) -> Message:
    number, *fields = item
    kind = _KINDS[_natural(number)]
    if kind is Request:
        return Request(_natural(fields[0]), _operation(fields[1]))
    if kind is Welcome:
        pins = [_pin(pin) for pin in fields[1]]  # type: ignore[attr-defined]
        if len(pins) != PINS:
            raise ProtocolError(f"{len(pins)} pins instead of {PINS}")
        return Welcome(_natural(fields[0]), pins)
    if kind is Changed:
        pin, state, edge, time = fields
        return Changed(_natural(pin), _pin(state), bool(edge), float(time))  # type: ignore[arg-type]
    if kind is Done:
        return Done(_natural(*fields))
    if kind is Refused:
        return Refused(_natural(fields[0]), str(fields[1]))
    return Hello(_natural(fields[0]), str(fields[1]))


def _operation(item: object) -> Operation | None:
    if item is None:
        return None
    number, *fields = item  # type: ignore[misc]
    operation: Operation = _OPERATIONS[_natural(number)](*fields)
    if isinstance(operation, Write):
        for pair in operation.levels:
            _pin_number, _level = pair
    return operation


def _pin(item: object) -> Pin:
    function, pull, world, latch = item  # type: ignore[misc]
    return Pin(Function(function), Pull(pull), None if world is None else int(bool(world)), int(bool(latch)))


def _natural(item: object) -> int:
    if not isinstance(item, int) or item < 0:
        raise ProtocolError(f"{item!r} is not a number from 0")
    return item
