"""Convert values to XML: small values in one step, large values in several steps.

Pure. Source: http://xmlrpc.com/spec.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from minirospy.base.errors import RpcProtocolError
from minirospy.base.steps import ALONE, Need, Steps
from minirospy.core.wire.xmlrpc_reader import MAX_DEPTH, DateTime

__all__ = ["Output", "escape", "is_numpy", "write", "write_in_steps"]

_STEP_BYTES = 8192
_STEP_ITEMS = 300
_STEP_LETTERS = 65536
# size in bytes above which no other response may be written at the same time
_ALONE_BYTES = 1024 * 1024


def escape(text: str) -> str:
    """Escape a string for XML."""
    if "&" in text:
        text = text.replace("&", "&amp;")
    if "<" in text:
        text = text.replace("<", "&lt;")
    if ">" in text:
        text = text.replace(">", "&gt;")
    if "\r" in text:
        # XML parsers would turn a bare carriage return into a line feed.
        text = text.replace("\r", "&#13;")
    return text


def _write_int(value: int, parts: list[str], depth: int) -> None:
    if not -(2**31) <= value < 2**31:
        raise RpcProtocolError(f"the integer {value} does not fit XML-RPC's 32 bits")
    parts.append(f"<value><int>{value:d}</int></value>")


def _write_bool(value: bool, parts: list[str], depth: int) -> None:
    parts.append(f"<value><boolean>{value:d}</boolean></value>")


def _write_float(value: float, parts: list[str], depth: int) -> None:
    # Call float's own repr: that of a subclass, such as numpy's, may be different.
    parts.append(f"<value><double>{float.__repr__(value)}</double></value>")


def _write_str(value: str, parts: list[str], depth: int) -> None:
    parts.append(f"<value><string>{escape(value)}</string></value>")


def _write_list(value: Sequence[object], parts: list[str], depth: int) -> None:
    parts.append("<value><array><data>")
    for item in value:
        # Check for strings first, because most lists contain them.
        if type(item) is str:
            parts.append(f"<value><string>{escape(item)}</string></value>")
        else:
            write(item, parts, depth)
    parts.append("</data></array></value>")


def _write_dict(value: Mapping[str, object], parts: list[str], depth: int) -> None:
    parts.append("<value><struct>\n")
    for key, item in value.items():
        if not isinstance(key, str):
            raise RpcProtocolError(f"the key {key!r} of a dictionary is not a string")
        parts.append(f"<member><name>{escape(key)}</name>")
        write(item, parts, depth)
        parts.append("</member>\n")
    parts.append("</struct></value>")


def _write_bytes(value: bytes, parts: list[str], depth: int) -> None:
    import base64

    parts.append(f"<value><base64>{base64.b64encode(value).decode()}</base64></value>")


_Writer = Callable[[Any, list[str], int], None]
_WRITERS: dict[type, _Writer] = {
    int: _write_int,
    bool: _write_bool,
    float: _write_float,
    str: _write_str,
    list: _write_list,
    tuple: _write_list,
    dict: _write_dict,
    DateTime: lambda value, parts, _: parts.append(
        f"<value><dateTime.iso8601>{escape(value.value)}</dateTime.iso8601></value>"
    ),
    bytes: _write_bytes,
    bytearray: _write_bytes,
}


def write(value: object, parts: list[str], depth: int) -> None:
    """Append a value's XML to ``parts``. Raise RpcProtocolError if XML-RPC has no type for it."""
    if depth > MAX_DEPTH:
        raise RpcProtocolError(f"a value is nested deeper than {MAX_DEPTH} levels")
    writer = _WRITERS.get(type(value))
    if writer is None:
        writer = _writer_of_kin(value)
    writer(value, parts, depth + 1)


def is_numpy(value: object) -> bool:
    """Return whether a value is a numpy number or array that ``tolist()`` converts to Python values.

    Some numpy types have no counterpart in Python.
    """
    return hasattr(value, "dtype") and hasattr(value, "tolist") and type(value.tolist()) is not type(value)


class Output:
    """XML written in steps: the current parts, and the completed pieces."""

    def __init__(self, most: int) -> None:
        self.parts: list[str] = []
        self._pieces: list[bytes] = []
        self._size = 0
        self._most = most
        self._is_alone = False

    def step(self) -> Need | None:
        """Complete a piece from the current parts; return ALONE if the rest should be written alone, else None.

        Raise RpcProtocolError if the limit is exceeded.
        """
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
        """Complete the last piece and return all pieces."""
        self.step()
        return self._pieces


def write_in_steps(value: Any, out: Output, depth: int) -> Steps[None]:
    """Like :func:`write`, but in steps, for a value that may be large."""
    if depth > MAX_DEPTH:
        raise RpcProtocolError(f"a value is nested deeper than {MAX_DEPTH} levels")
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


def _write_list_in_steps(value: Sequence[Any], out: Output, depth: int) -> Steps[None]:
    out.parts.append("<value><array><data>")
    for number, item in enumerate(value):
        kind = type(item)
        if kind is int or kind is float or (kind is str and len(item) < _STEP_ITEMS):
            write(item, out.parts, depth)
        else:
            yield from write_in_steps(item, out, depth)
        if number % _STEP_ITEMS == _STEP_ITEMS - 1 or len(out.parts) > 4 * _STEP_ITEMS:
            yield out.step()
    out.parts.append("</data></array></value>")


def _write_dict_in_steps(value: Mapping[str, object], out: Output, depth: int) -> Steps[None]:
    out.parts.append("<value><struct>\n")
    for key, item in value.items():
        if not isinstance(key, str):
            raise RpcProtocolError(f"the key {key!r:.60} of a dictionary is not a string")
        out.parts.append("<member><name>")
        yield from _write_text_in_steps(key, out)
        out.parts.append("</name>")
        yield from write_in_steps(item, out, depth)
        out.parts.append("</member>\n")
        if len(out.parts) > 4 * _STEP_ITEMS:
            yield out.step()
    out.parts.append("</struct></value>")


def _write_text_in_steps(text: str, out: Output) -> Steps[None]:
    for at in range(0, len(text), _STEP_LETTERS):
        out.parts.append(escape(text[at : at + _STEP_LETTERS]))
        if at:
            yield out.step()


def _write_bytes_in_steps(value: bytes, out: Output) -> Steps[None]:
    import base64

    out.parts.append("<value><base64>")
    # Base64 encodes three bytes as four characters.
    size = 3 * _STEP_BYTES
    for at in range(0, len(value), size):
        out.parts.append(base64.b64encode(value[at : at + size]).decode())
        yield out.step()
    out.parts.append("</base64></value>")


def _writer_of_kin(value: object) -> _Writer:
    """Return the writer for a subclass of a known type, a date, an xmlrpc.client wrapper class, or a numpy number or array."""
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
            f"<value><dateTime.iso8601>{escape(date.value)}</dateTime.iso8601></value>"
        )
    if is_numpy(value):
        return lambda array, parts, depth: write(array.tolist(), parts, depth)
    raise RpcProtocolError(f"XML-RPC has no type for {type(value).__name__}: {str(value)[:60]}")
