"""Parse XML-RPC documents to values with expat, as their bytes arrive.

Pure. Rejects input that could do harm: document types (and therefore entities), nesting beyond 64 levels, a million
elements, tags of 64 KiB, strings of 64 MiB in memory. Source: http://xmlrpc.com/spec.md.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from io import BytesIO
from typing import Any, NamedTuple

from minirospy.base.errors import RpcProtocolError

__all__ = ["MAX_DEPTH", "DateTime", "Reader", "read_document"]

MAX_DEPTH = 64
MAX_ELEMENTS = 1_000_000  # maximum number of elements per document; parsing this many takes a few seconds

_MIB = 1024 * 1024
MAX_MEMORY = 64 * _MIB  # maximum bytes in memory of all long strings in one document

MAX_WIDE = 16 * _MIB
"""Maximum size, in bytes, of a string with a character beyond U+00FF: its characters then take 2 or 4 bytes each, and the
string is copied.
"""

MAX_TOKEN = 65536  # maximum bytes in a tag, a comment or similar

MAX_SCALAR = 2048  # maximum characters in a number, a boolean or a date

_LONG_TEXT = 16  # number of 8-KiB pieces above which a string is long

_GROWTH_SHIFT = 17
"""The new pieces of a long string are joined to the string once they exceed a sixteenth of its length.

A length in characters, shifted right by this number, is a sixteenth of the length in 8-KiB pieces.
"""


class DateTime(NamedTuple):
    """A date that is not in XML-RPC's format, as received.

    The date may be any text, because other implementations accept it.
    """

    value: str


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
    """Reads a document into ``root``, ``method``, ``params`` and ``is_fault`` as its bytes arrive.

    ``_containers`` contains the incomplete lists and dictionaries; ``_values`` has an entry for each incomplete
    ``<value>``: an empty list, or a list with one element once the value is known.
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
        self._left = MAX_ELEMENTS
        self._tag: str
        # The number of bytes fed, and the memory that the long strings use.
        self._fed = 0
        self._memory = 0
        # The part of a long string that has been read so far, and the string's bytes per character.
        self._joined = ""
        self._width = 1
        # The decoded part of a long base64 value.
        self._binary: BytesIO | None = None

        parser = self._parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._text.append
        parser.StartDoctypeDeclHandler = self._refuse_doctype

    def feed(self, data: bytes | bytearray | memoryview, *, is_last: bool = False) -> None:
        """Parse more data. Raise RpcProtocolError if the document is invalid or exceeds a limit."""
        try:
            self._parser.Parse(data, is_last)
        except self._errors as error:
            raise RpcProtocolError(f"not XML-RPC: {error}") from error
        self._fed += len(data)
        # Limit incomplete tags and comments: the parser scans them again whenever more data arrives.
        if not is_last and self._fed - self._parser.CurrentByteIndex > MAX_TOKEN:
            raise RpcProtocolError(f"a tag or comment of more than {MAX_TOKEN} bytes")
        if len(self._text) - _LONG_TEXT > len(self._joined) >> _GROWTH_SHIFT:
            self._join_text()

    def close(self) -> None:
        """Release the parser, because its handlers refer to this object and to all parsed values. Idempotent."""
        parser = self._parser
        parser.StartElementHandler = parser.EndElementHandler = None
        parser.CharacterDataHandler = parser.StartDoctypeDeclHandler = None

    def _refuse_doctype(self, *_: object) -> None:
        raise RpcProtocolError("a document type has no place in XML-RPC")

    def _start(self, tag: str, _: object) -> None:
        self._depth += 1
        # Each level of a value uses at most four elements (struct, member, value; array, data, value).
        if self._depth > 4 * MAX_DEPTH:
            raise RpcProtocolError(f"a value is nested deeper than {MAX_DEPTH} levels")
        self._left -= 1
        if self._left < 0:
            raise RpcProtocolError(f"more than {MAX_ELEMENTS} elements")

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

    def _scalar(self, tag: str, read: Callable[[str], Any]) -> object:
        text = self._whole_text()
        if self._binary:
            self._binary.write(read(text))
            return self._binary.getvalue()
        if tag not in ("string", "base64") and len(text) > MAX_SCALAR:
            raise RpcProtocolError(f"a value of type {tag} has more than {MAX_SCALAR} characters")
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
        """Return the text of the current element."""
        if len(self._text) > 1 or self._joined:
            self._join_text()
        return self._joined or "".join(self._text)

    def _join_text(self) -> None:
        """Join the pieces of a long string as they arrive, because joining all of them at the end would take too long.

        Raise RpcProtocolError if the strings exceed the memory limit.
        """
        if self._tag == "base64":
            self._decode_base64()
            return
        more = "".join(self._text)
        self._text.clear()
        joined, self._joined = self._joined, ""

        # All characters in a string use as many bytes as the widest one.
        width = max(self._width, _width(more))
        memory = width * (len(joined) + len(more))
        self._memory += memory - self._width * len(joined)
        self._width = width
        if self._memory > MAX_MEMORY:
            raise RpcProtocolError(f"a value of more than {MAX_MEMORY // _MIB} MiB in memory", status=413)
        if width > 1 and memory > MAX_WIDE:
            most = MAX_WIDE // _MIB
            raise RpcProtocolError(f"a text of wide characters of more than {most} MiB in memory", status=413)

        # Python appends in place if a local variable is the only reference to the string.
        joined += more
        self._joined = joined

    def _decode_base64(self) -> None:
        text = re.sub("[^A-Za-z0-9+/=]", "", "".join(self._text))
        whole = len(text) - len(text) % 4
        self._binary = self._binary or BytesIO()
        self._binary.write(_read_base64(text[:whole]))
        self._text[:] = [text[whole:]]


def _width(text: str) -> int:
    """Return the number of bytes per character that a long string uses in memory."""
    return 1 if text.isascii() else min(4, sys.getsizeof(text) // len(text))


def read_document(body: bytes | bytearray) -> Reader:
    """Read a whole document. Raise RpcProtocolError if it is invalid or exceeds a limit."""
    reader = Reader()
    try:
        reader.feed(body, is_last=True)
    finally:
        reader.close()
    return reader
