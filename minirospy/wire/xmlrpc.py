"""XML-RPC: calls and answers as bytes, and back.

Pure; parses with expat, and what is plain without it (``wire/xmlrpc_plain.py``). A server, which serves others
meanwhile, does both in short steps where a document is long. Refuses what a caller could hurt with: document types
(and so entities), nesting beyond 64 levels, a million elements, tags of 64 KiB, texts of 64 MiB in memory. Source:
http://xmlrpc.com/spec.md, and http://wiki.ros.org/ROS/Master_API for the types that ROS uses.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping, Sequence
from io import BytesIO
from typing import Any, NamedTuple

from minirospy.errors import RpcFault, RpcProtocolError
from minirospy.steps import ALONE, Need, Steps
from minirospy.wire.xmlrpc_plain import read_plain

__all__ = [
    "Call",
    "DateTime",
    "Reader",
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

_MAX_DEPTH = 64
_MAX_ELEMENTS = 1_000_000
"""In one document: some seconds of work."""

_MIB = 1024 * 1024
_MAX_MEMORY = 64 * _MIB
"""Of the long texts of one document: a character beyond U+FFFF makes each one of its text take four bytes."""

_MAX_TOKEN = 65536
"""Bytes of a tag, a comment or the like."""

_MAX_SCALAR = 2048
"""Characters of a number, a boolean or a date."""

_LONG_TEXT = 16
"""Pieces of a text, 8 KiB each, after which it is a long one."""

_GROWTH_SHIFT = 17
"""A long text grows by a sixteenth of what it has already: as many pieces of 8 KiB as its length shifted by this."""

_PLAIN_BYTES = 32768
"""A document up to this length is read in one step where it is plain."""

_STEP_BYTES = 8192
_STEP_ITEMS = 300
_STEP_LETTERS = 65536
_ALONE_BYTES = _MIB
"""Of an answer, before it demands to be the only one that is being written."""

_HEAD = "<?xml version='1.0'?>\n"


class DateTime(NamedTuple):
    """A date in another form than XML-RPC's, as it came: others take any text for one."""

    value: str


class Call(NamedTuple):
    """A method call."""

    method: str
    args: list[Any]


class Serialized:
    """An answer that is XML already, in pieces: a long one takes long to join."""

    __slots__ = ("pieces",)

    def __init__(self, pieces: Sequence[bytes]) -> None:
        self.pieces = pieces


def serialize_call(method: str, args: Sequence[Any]) -> bytes:
    """Return a call as XML. Raises RpcProtocolError on a value that XML-RPC has no type for."""
    parts = [_HEAD, "<methodCall><methodName>", _escape(method), "</methodName><params>"]
    for value in args:
        parts.append("<param>")
        _write(value, parts, 0)
        parts.append("</param>")
    parts.append("</params></methodCall>\n")
    return "".join(parts).encode()


def serialize_response(value: Any) -> bytes:
    """Return a successful answer as XML."""
    if type(value) is Serialized:
        return b"".join(value.pieces)
    parts = [_HEAD, "<methodResponse><params><param>"]
    _write(value, parts, 0)
    parts.append("</param></params></methodResponse>\n")
    return "".join(parts).encode()


def serialize_fault(code: int, text: str) -> bytes:
    """Return a fault as XML."""
    parts = [_HEAD, "<methodResponse><fault>"]
    _write({"faultCode": code, "faultString": text}, parts, 0)
    parts.append("</fault></methodResponse>\n")
    return "".join(parts).encode()


def serialize_call_in_steps(method: str, args: Sequence[Any], most: int) -> Steps[list[bytes]]:
    """Return a call as pieces of XML, as :func:`serialize_response_in_steps` does an answer."""
    out = _Output(most)
    out.parts += [_HEAD, "<methodCall><methodName>", _escape(method), "</methodName><params>"]
    for value in args:
        out.parts.append("<param>")
        yield from _write_in_steps(value, out, 0)
        out.parts.append("</param>")
    out.parts.append("</params></methodCall>\n")
    return out.finish()


def serialize_response_in_steps(value: Any, most: int) -> Steps[list[bytes]]:
    """Return a successful answer as pieces of XML. Raises RpcProtocolError where it has more than ``most`` bytes."""
    out = _Output(most)
    out.parts += [_HEAD, "<methodResponse><params><param>"]
    yield from _write_in_steps(value, out, 0)
    out.parts.append("</param></params></methodResponse>\n")
    return out.finish()


def parse_call_in_steps(body: bytes | bytearray) -> Steps[Call]:
    """Return the call in a long ``body``. Raises RpcProtocolError."""
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
    """Return the call in ``body``. Raises RpcProtocolError."""
    plain = read_plain(body)
    if plain and plain[0] is not None:
        return Call(plain[0], plain[1])
    return _call(_read(body))


def parse_response(body: bytes | bytearray) -> Any:
    """Return the value in an answer. Raises RpcFault where the peer answered with one, else RpcProtocolError."""
    plain = read_plain(body)
    if plain and plain[0] is None and len(plain[1]) == 1:
        return plain[1][0]
    reader = _read(body)
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


# --- values to XML


def _escape(text: str) -> str:
    if "&" in text:
        text = text.replace("&", "&amp;")
    if "<" in text:
        text = text.replace("<", "&lt;")
    if ">" in text:
        text = text.replace(">", "&gt;")
    if "\r" in text:
        # A bare carriage return would be read as a line feed.
        text = text.replace("\r", "&#13;")
    return text


def _write_int(value: int, parts: list[str], depth: int) -> None:
    if not -(2**31) <= value < 2**31:
        raise RpcProtocolError(f"the integer {value} does not fit XML-RPC's 32 bits")
    parts.append(f"<value><int>{value:d}</int></value>")


def _write_bool(value: bool, parts: list[str], depth: int) -> None:
    parts.append(f"<value><boolean>{value:d}</boolean></value>")


def _write_float(value: float, parts: list[str], depth: int) -> None:
    # A subclass, such as numpy's, may write itself in another way.
    parts.append(f"<value><double>{float.__repr__(value)}</double></value>")


def _write_str(value: str, parts: list[str], depth: int) -> None:
    parts.append(f"<value><string>{_escape(value)}</string></value>")


def _write_list(value: Sequence[Any], parts: list[str], depth: int) -> None:
    parts.append("<value><array><data>")
    for item in value:
        # Most lists are of strings.
        if type(item) is str:
            parts.append(f"<value><string>{_escape(item)}</string></value>")
        else:
            _write(item, parts, depth)
    parts.append("</data></array></value>")


def _write_dict(value: Mapping[str, Any], parts: list[str], depth: int) -> None:
    parts.append("<value><struct>\n")
    for key, item in value.items():
        if not isinstance(key, str):
            raise RpcProtocolError(f"the key {key!r} of a dictionary is not a string")
        parts.append(f"<member><name>{_escape(key)}</name>")
        _write(item, parts, depth)
        parts.append("</member>\n")
    parts.append("</struct></value>")


def _write_bytes(value: bytes, parts: list[str], depth: int) -> None:
    import base64

    parts.append(f"<value><base64>{base64.b64encode(value).decode()}</base64></value>")


_WRITERS: dict[type, Callable[[Any, list[str], int], None]] = {
    int: _write_int,
    bool: _write_bool,
    float: _write_float,
    str: _write_str,
    list: _write_list,
    tuple: _write_list,
    dict: _write_dict,
    DateTime: lambda value, parts, _: parts.append(
        f"<value><dateTime.iso8601>{_escape(value.value)}</dateTime.iso8601></value>"
    ),
    bytes: _write_bytes,
    bytearray: _write_bytes,
}


def _write(value: Any, parts: list[str], depth: int) -> None:
    if depth > _MAX_DEPTH:
        raise RpcProtocolError(f"a value is nested deeper than {_MAX_DEPTH} levels")
    writer = _WRITERS.get(type(value))
    if writer is None:
        writer = _writer_of_kin(value)
    writer(value, parts, depth + 1)


class _Output:
    """XML that is written in steps: what is being written, and the pieces that are done."""

    def __init__(self, most: int) -> None:
        self.parts: list[str] = []
        self._pieces: list[bytes] = []
        self._size = 0
        self._most = most
        self._is_alone = False

    def step(self) -> Need | None:
        """Put away what was written; return what to yield. Raises RpcProtocolError where it is too much."""
        piece = "".join(self.parts).encode()
        self.parts.clear()
        self._pieces.append(piece)
        self._size += len(piece)
        if self._size > self._most:
            raise RpcProtocolError(f"more than {self._most} bytes of XML")
        if self._is_alone or self._size < _ALONE_BYTES:
            return None
        self._is_alone = True
        return ALONE

    def finish(self) -> list[bytes]:
        """Return the pieces."""
        self.step()
        return self._pieces


def _write_in_steps(value: Any, out: _Output, depth: int) -> Steps[None]:
    if depth > _MAX_DEPTH:
        raise RpcProtocolError(f"a value is nested deeper than {_MAX_DEPTH} levels")
    writer = _WRITERS.get(type(value)) or _writer_of_kin(value)
    if writer is _write_list:
        yield from _write_list_in_steps(value, out, depth + 1)
    elif writer is _write_dict:
        yield from _write_dict_in_steps(value, out, depth + 1)
    elif writer is _write_str and len(value) > _STEP_LETTERS:
        out.parts.append("<value><string>")
        yield from _write_text_in_steps(value, out)
        out.parts.append("</string></value>")
    elif writer is _write_bytes and len(value) > _STEP_LETTERS:
        yield from _write_bytes_in_steps(value, out)
    else:
        writer(value, out.parts, depth + 1)


def _write_list_in_steps(value: Sequence[Any], out: _Output, depth: int) -> Steps[None]:
    out.parts.append("<value><array><data>")
    for number, item in enumerate(value):
        kind = type(item)
        if kind is int or kind is float or (kind is str and len(item) < _STEP_ITEMS):
            _write(item, out.parts, depth)
        else:
            yield from _write_in_steps(item, out, depth)
        if number % _STEP_ITEMS == _STEP_ITEMS - 1 or len(out.parts) > 4 * _STEP_ITEMS:
            yield out.step()
    out.parts.append("</data></array></value>")


def _write_dict_in_steps(value: Mapping[str, Any], out: _Output, depth: int) -> Steps[None]:
    out.parts.append("<value><struct>\n")
    for key, item in value.items():
        if not isinstance(key, str):
            raise RpcProtocolError(f"the key {key!r:.60} of a dictionary is not a string")
        out.parts.append("<member><name>")
        yield from _write_text_in_steps(key, out)
        out.parts.append("</name>")
        yield from _write_in_steps(item, out, depth)
        out.parts.append("</member>\n")
        if len(out.parts) > 4 * _STEP_ITEMS:
            yield out.step()
    out.parts.append("</struct></value>")


def _write_text_in_steps(text: str, out: _Output) -> Steps[None]:
    for at in range(0, len(text), _STEP_LETTERS):
        out.parts.append(_escape(text[at : at + _STEP_LETTERS]))
        if at:
            yield out.step()


def _write_bytes_in_steps(value: bytes, out: _Output) -> Steps[None]:
    import base64

    out.parts.append("<value><base64>")
    # Three bytes make four characters.
    size = 3 * _STEP_BYTES
    for at in range(0, len(value), size):
        out.parts.append(base64.b64encode(value[at : at + size]).decode())
        yield out.step()
    out.parts.append("</base64></value>")


def _writer_of_kin(value: Any) -> Callable[[Any, list[str], int], None]:
    """Return the writer for a subclass of a known type, a date, or xmlrpc.client's wrappers."""
    for kind, writer in _WRITERS.items():
        if isinstance(value, kind):
            return writer
    if hasattr(value, "isoformat"):
        return lambda date, parts, _: parts.append(
            f"<value><dateTime.iso8601>{date:%Y%m%dT%H:%M:%S}</dateTime.iso8601></value>"
        )
    if isinstance(getattr(value, "data", None), bytes):
        return lambda binary, parts, depth: _write_bytes(binary.data, parts, depth)
    if type(value).__name__ == "DateTime" and isinstance(getattr(value, "value", None), str):
        return lambda date, parts, _: parts.append(
            f"<value><dateTime.iso8601>{_escape(date.value)}</dateTime.iso8601></value>"
        )
    raise RpcProtocolError(f"XML-RPC has no type for {type(value).__name__}: {str(value)[:60]}")


# --- XML to values


def _read_bool(text: str) -> bool:
    if text.strip() not in ("0", "1"):
        raise ValueError(f"a boolean is 0 or 1, not {text!r}")
    return text.strip() == "1"


def _read_date(text: str) -> object:
    import datetime

    try:
        return datetime.datetime.strptime(text, "%Y%m%dT%H:%M:%S")
    except ValueError:
        return DateTime(text)


def _read_base64(text: str) -> bytes:
    import base64

    return base64.b64decode(text)


_SCALARS: dict[str, Callable[[str], object]] = {
    "int": int,
    "i4": int,
    "i8": int,
    "i1": int,
    "i2": int,
    "string": str,
    "double": float,
    "boolean": _read_bool,
    "dateTime.iso8601": _read_date,
    "base64": _read_base64,
}


class Reader:
    """Reads a document, as its bytes arrive, into ``root``, ``method``, ``params`` and ``is_fault``.

    ``_containers`` holds the lists and dictionaries that are not complete yet; ``_values`` one entry for each
    ``<value>`` that is: a one-element list once it has something in it.
    """

    def __init__(self) -> None:
        from xml.parsers import expat

        self.root = ""
        self.method: str | None = None
        self.params: list[object] = []
        self.is_fault = False
        self._errors = (expat.ExpatError, ValueError, LookupError)
        self._text: list[str] = []
        self._containers: list[list[object] | dict[str, object]] = []
        self._names: list[str] = []
        self._values: list[list[object]] = []
        self._depth = 0
        self._left = _MAX_ELEMENTS
        self._tag = ""
        # The bytes that were fed, and those that the long texts take in memory.
        self._fed = 0
        self._memory = 0
        # What is joined of a long text, and the bytes that each of its characters takes.
        self._joined = ""
        self._width = 1
        # A long base64 as far as it is decoded.
        self._binary: BytesIO | None = None

        parser = self._parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._text.append
        parser.StartDoctypeDeclHandler = self._refuse_doctype

    def feed(self, data: bytes | bytearray | memoryview, *, is_last: bool = False) -> None:
        """Read some more. Raises RpcProtocolError."""
        try:
            self._parser.Parse(data, is_last)
        except self._errors as error:
            raise RpcProtocolError(f"not XML-RPC: {error}") from error
        self._fed += len(data)
        # The parser looks at an incomplete tag or comment again whenever more of it comes.
        if not is_last and self._fed - self._parser.CurrentByteIndex > _MAX_TOKEN:
            raise RpcProtocolError(f"a tag or comment of more than {_MAX_TOKEN} bytes")
        if len(self._text) - _LONG_TEXT > len(self._joined) >> _GROWTH_SHIFT:
            self._join_text()

    def close(self) -> None:
        """Release the parser, whose handlers refer to this object and to all that was read. Idempotent."""
        parser = self._parser
        parser.StartElementHandler = parser.EndElementHandler = None
        parser.CharacterDataHandler = parser.StartDoctypeDeclHandler = None

    def _refuse_doctype(self, *_: object) -> None:
        raise RpcProtocolError("a document type has no place in XML-RPC")

    def _start(self, tag: str, _: object) -> None:
        self._depth += 1
        # Each level of a value takes four elements at most (struct, member, value; array, data, value).
        if self._depth > 4 * _MAX_DEPTH:
            raise RpcProtocolError(f"a value is nested deeper than {_MAX_DEPTH} levels")
        self._left -= 1
        if self._left < 0:
            raise RpcProtocolError(f"more than {_MAX_ELEMENTS} elements")
        if not self.root:
            self.root = tag
        self._tag = tag
        self._clear_text()
        if tag == "value":
            self._values.append([])
        elif tag == "array":
            self._containers.append([])
        elif tag == "struct":
            self._containers.append({})
        elif tag == "fault":
            self.is_fault = True

    def _end(self, tag: str) -> None:
        self._depth -= 1
        scalar = _SCALARS.get(tag)
        if scalar is not None:
            self._values[-1].append(self._scalar(tag, scalar))
        elif tag == "value":
            self._end_value()
        elif tag in ("array", "struct"):
            self._values[-1].append(self._containers.pop())
        elif tag == "name":
            self._names.append(self._whole_text())
        elif tag == "member":
            self._names.pop()
        elif tag == "methodName":
            self.method = self._whole_text()
        elif tag == "nil":
            raise RpcProtocolError("ROS has no nil")
        self._clear_text()

    def _scalar(self, tag: str, read: Callable[[str], Any]) -> Any:
        text = self._whole_text()
        if self._binary:
            self._binary.write(read(text))
            return self._binary.getvalue()
        if tag not in ("string", "base64") and len(text) > _MAX_SCALAR:
            raise RpcProtocolError(f"a value of type {tag} has more than {_MAX_SCALAR} characters")
        return read(text)

    def _end_value(self) -> None:
        entry = self._values.pop()
        # A value without a type is a string.
        value = entry[0] if entry else self._whole_text()
        if len(self._values) != len(self._containers):
            raise RpcProtocolError("a value inside a value")
        if not self._containers:
            self.params.append(value)
            return
        container = self._containers[-1]
        if isinstance(container, list):
            container.append(value)
        else:
            container[self._names[-1]] = value

    def _clear_text(self) -> None:
        self._text.clear()
        if self._joined or self._binary:
            self._joined = ""
            self._width = 1
            self._binary = None

    def _whole_text(self) -> str:
        """Return the text of the present element."""
        if len(self._text) > 1 or self._joined:
            self._join_text()
        return self._joined or "".join(self._text)

    def _join_text(self) -> None:
        """Join what has come of a long text, which would take too long at its end. Raises RpcProtocolError."""
        if self._tag == "base64":
            self._decode_base64()
            return
        more = "".join(self._text)
        self._text.clear()
        joined, self._joined = self._joined, ""

        # All characters take as much as the widest one.
        width = max(self._width, _width(more))
        self._memory += width * (len(joined) + len(more)) - self._width * len(joined)
        self._width = width
        if self._memory > _MAX_MEMORY:
            raise RpcProtocolError(f"a value of more than {_MAX_MEMORY // _MIB} MiB in memory", status=413)

        # Python copies nothing where a local variable is the only one that refers to a text.
        joined += more
        self._joined = joined

    def _decode_base64(self) -> None:
        text = re.sub("[^A-Za-z0-9+/=]", "", "".join(self._text))
        whole = len(text) - len(text) % 4
        self._binary = self._binary or BytesIO()
        self._binary.write(_read_base64(text[:whole]))
        self._text[:] = [text[whole:]]


def _width(text: str) -> int:
    """Return the bytes that each character of a long text takes in memory."""
    return 1 if text.isascii() else min(4, sys.getsizeof(text) // len(text))


def _read(body: bytes | bytearray) -> Reader:
    reader = Reader()
    try:
        reader.feed(body, is_last=True)
    finally:
        reader.close()
    return reader
