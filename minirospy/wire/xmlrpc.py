"""XML-RPC: calls and answers as bytes, and back.

Pure; parses with expat, and what is plain without it (``wire/xmlrpc_plain.py``). Refuses what a caller could hurt
with: document types (and so entities), nesting beyond 64 levels, a million elements. Source:
http://xmlrpc.com/spec.md, and http://wiki.ros.org/ROS/Master_API for the types that ROS uses.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from minirospy.errors import RpcFault, RpcProtocolError
from minirospy.wire.xmlrpc_plain import read_plain

__all__ = [
    "Call",
    "DateTime",
    "Serialized",
    "parse_call",
    "parse_response",
    "serialize_call",
    "serialize_fault",
    "serialize_response",
]

_MAX_DEPTH = 64
_MAX_ELEMENTS = 1_000_000
"""In one document: some seconds of work."""

_HEAD = "<?xml version='1.0'?>\n"


class DateTime(NamedTuple):
    """A date in another form than XML-RPC's, as it came: others take any text for one."""

    value: str


class Call(NamedTuple):
    """A method call."""

    method: str
    args: list[Any]


class Serialized(bytes):
    """An answer that is XML already."""


def serialize_call(method: str, args: Sequence[Any]) -> bytes:
    """A call as XML. Raises RpcProtocolError on a value that XML-RPC has no type for."""
    parts = [_HEAD, "<methodCall><methodName>", _escape(method), "</methodName><params>"]
    for value in args:
        parts.append("<param>")
        _write(value, parts, 0)
        parts.append("</param>")
    parts.append("</params></methodCall>\n")
    return "".join(parts).encode()


def serialize_response(value: Any) -> bytes:
    """A successful answer as XML."""
    if type(value) is Serialized:
        return value
    parts = [_HEAD, "<methodResponse><params><param>"]
    _write(value, parts, 0)
    parts.append("</param></params></methodResponse>\n")
    return "".join(parts).encode()


def serialize_fault(code: int, text: str) -> bytes:
    """A fault as XML."""
    parts = [_HEAD, "<methodResponse><fault>"]
    _write({"faultCode": code, "faultString": text}, parts, 0)
    parts.append("</fault></methodResponse>\n")
    return "".join(parts).encode()


def parse_call(body: bytes) -> Call:
    """The call in ``body``. Raises RpcProtocolError."""
    plain = read_plain(body)
    if plain and plain[0] is not None:
        return Call(plain[0], plain[1])
    reader = _Reader(body)
    if reader.root != "methodCall" or reader.method is None:
        raise RpcProtocolError("not an XML-RPC method call")
    return Call(reader.method, reader.params)


def parse_response(body: bytes) -> Any:
    """The value in an answer. Raises RpcFault where the peer answered with one, else RpcProtocolError."""
    plain = read_plain(body)
    if plain and plain[0] is None and len(plain[1]) == 1:
        return plain[1][0]
    reader = _Reader(body)
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


def _writer_of_kin(value: Any) -> Callable[[Any, list[str], int], None]:
    """The writer for a subclass of a known type, a date, or xmlrpc.client's wrappers."""
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


def _read_date(text: str) -> Any:
    import datetime

    try:
        return datetime.datetime.strptime(text, "%Y%m%dT%H:%M:%S")
    except ValueError:
        return DateTime(text)


def _read_base64(text: str) -> bytes:
    import base64

    return base64.b64decode(text)


_SCALARS: dict[str, Callable[[str], Any]] = {
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


class _Reader:
    """Reads a document into ``root``, ``method``, ``params`` and ``is_fault``.

    ``_open`` holds the lists and dictionaries that are not complete yet; ``_values`` one entry for each
    ``<value>`` that is: a one-element list once it has something in it.
    """

    def __init__(self, body: bytes) -> None:
        from xml.parsers import expat

        self.root = ""
        self.method: str | None = None
        self.params: list[Any] = []
        self.is_fault = False
        self._text: list[str] = []
        self._containers: list[list[Any] | dict[str, Any]] = []
        self._names: list[str] = []
        self._values: list[list[Any]] = []
        self._depth = 0
        self._left = _MAX_ELEMENTS
        parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._text.append
        parser.StartDoctypeDeclHandler = self._refuse_doctype
        try:
            parser.Parse(body, True)
        except (expat.ExpatError, ValueError, LookupError) as error:
            raise RpcProtocolError(f"not XML-RPC: {error}") from error

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
        self._text.clear()
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
            self._values[-1].append(scalar("".join(self._text)))
        elif tag == "value":
            self._end_value()
        elif tag in ("array", "struct"):
            self._values[-1].append(self._containers.pop())
        elif tag == "name":
            self._names.append("".join(self._text))
        elif tag == "member":
            self._names.pop()
        elif tag == "methodName":
            self.method = "".join(self._text)
        elif tag == "nil":
            raise RpcProtocolError("ROS has no nil")
        self._text.clear()

    def _end_value(self) -> None:
        entry = self._values.pop()
        # A value without a type is a string.
        value = entry[0] if entry else "".join(self._text)
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
