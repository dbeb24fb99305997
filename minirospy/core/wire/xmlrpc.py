"""XML-RPC: convert calls and responses to bytes and back.

Pure; parses with expat (``core/wire/xmlrpc_reader.py``), and plain documents without it (``core/wire/xmlrpc_plain.py``).
Long documents can be read and written in short steps, for a server that must not block.
Source: http://xmlrpc.com/spec.md, and http://wiki.ros.org/ROS/Master_API for the types that ROS uses.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from minirospy.base.errors import RpcFault, RpcProtocolError
from minirospy.base.steps import Steps
from minirospy.core.wire.xmlrpc_plain import read_plain
from minirospy.core.wire.xmlrpc_reader import DateTime, Reader, read_document
from minirospy.core.wire.xmlrpc_writer import Output, escape, write, write_in_steps

__all__ = [
    "Call",
    "DateTime",
    "Serialized",
    "parse_call",
    "parse_call_in_steps",
    "parse_response",
    "serialize_call",
    "serialize_call_in_steps",
    "serialize_fault",
    "serialize_response",
    "serialize_response_in_steps",
]

_PLAIN_BYTES = 32768  # maximum length of a plain document that is read in one step

_STEP_BYTES = 8192

_HEAD = "<?xml version='1.0'?>\n"


class Call(NamedTuple):
    """A method call."""

    method: str
    args: list[object]


class Serialized:
    """A response that is already XML. It is kept in pieces, because joining the pieces of a long response takes time."""

    __slots__ = ("pieces",)

    def __init__(self, pieces: Sequence[bytes]) -> None:
        self.pieces = pieces


def serialize_call(method: str, args: Sequence[object]) -> bytes:
    """Serialize a call as XML. Raise RpcProtocolError if XML-RPC has no type for a value."""
    parts = [_HEAD, "<methodCall><methodName>", escape(method), "</methodName><params>"]
    for value in args:
        parts.append("<param>")
        write(value, parts, 0)
        parts.append("</param>")
    parts.append("</params></methodCall>\n")
    return "".join(parts).encode()


def serialize_response(value: object) -> bytes:
    """Serialize a successful response as XML."""
    if type(value) is Serialized:
        return b"".join(value.pieces)
    parts = [_HEAD, "<methodResponse><params><param>"]
    write(value, parts, 0)
    parts.append("</param></params></methodResponse>\n")
    return "".join(parts).encode()


def serialize_fault(code: int, text: str) -> bytes:
    """Serialize a fault as XML."""
    parts = [_HEAD, "<methodResponse><fault>"]
    write({"faultCode": code, "faultString": text}, parts, 0)
    parts.append("</fault></methodResponse>\n")
    return "".join(parts).encode()


def serialize_call_in_steps(method: str, args: Sequence[object], most: int) -> Steps[list[bytes]]:
    """Serialize a call as XML in pieces; see :func:`serialize_response_in_steps`."""
    out = Output(most)
    out.parts += [_HEAD, "<methodCall><methodName>", escape(method), "</methodName><params>"]
    for value in args:
        out.parts.append("<param>")
        yield from write_in_steps(value, out, 0)
        out.parts.append("</param>")
    out.parts.append("</params></methodCall>\n")
    return out.finish()


def serialize_response_in_steps(value: object, most: int) -> Steps[list[bytes]]:
    """Serialize a successful response as XML in pieces. Raise RpcProtocolError if it exceeds ``most`` bytes."""
    out = Output(most)
    out.parts += [_HEAD, "<methodResponse><params><param>"]
    yield from write_in_steps(value, out, 0)
    out.parts.append("</param></params></methodResponse>\n")
    return out.finish()


def parse_call_in_steps(body: bytes | bytearray) -> Steps[Call]:
    """Parse the call in a long ``body``. Raise RpcProtocolError if it is malformed."""
    plain = read_plain(body) if len(body) <= _PLAIN_BYTES else None
    if plain and plain[0] is not None:
        return Call(plain[0], plain[1])
    reader, view = Reader(), memoryview(body)
    try:
        for at in range(0, len(view), _STEP_BYTES):
            reader.feed(view[at : at + _STEP_BYTES])
            yield None
        reader.feed(b"", is_last=True)
    finally:
        reader.close()
    return _call(reader)


def parse_call(body: bytes | bytearray) -> Call:
    """Parse the call in ``body``. Raise RpcProtocolError if it is malformed."""
    plain = read_plain(body)
    if plain and plain[0] is not None:
        return Call(plain[0], plain[1])
    return _call(read_document(body))


def parse_response(body: bytes | bytearray) -> Any:
    """Parse a response and return its value. Raise RpcFault if the response is a fault, RpcProtocolError if it is malformed."""
    plain = read_plain(body)
    if plain and plain[0] is None and len(plain[1]) == 1:
        return plain[1][0]
    reader = read_document(body)
    if reader.root != "methodResponse":
        raise RpcProtocolError("not an XML-RPC answer")
    if reader.is_fault:
        match reader.params:
            case [{"faultCode": int(code), "faultString": text}]:
                raise RpcFault(code, str(text))
            case _:
                raise RpcProtocolError("an XML-RPC fault without code and text")
    if len(reader.params) != 1:
        raise RpcProtocolError("an XML-RPC answer without a value")
    return reader.params[0]


def _call(reader: Reader) -> Call:
    if reader.root != "methodCall" or reader.method is None:
        raise RpcProtocolError("not an XML-RPC method call")
    return Call(reader.method, reader.params)
