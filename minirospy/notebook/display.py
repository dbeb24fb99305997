"""Show messages as tables, and images as pictures, if they are the output of a cell."""

from __future__ import annotations

import base64
from html import escape
from typing import Any, Protocol

import genpy

from minirospy.base.errors import BridgeError
from minirospy.introspect.columns import leaves
from minirospy.web.video.options import Picture
from minirospy.web.video.pictures import COMPRESSED, IMAGE, encoded

__all__ = ["Shell", "hide_messages", "html_of", "show_messages"]

_MAX_ROWS = 100
_MAX_ITEMS = 8  # maximum number of array elements shown
_MAX_TEXT = 200  # maximum number of characters shown per value
_MAX_WIDTH = 640  # maximum width of a picture, in pixels


class _Formatter(Protocol):
    def for_type(self, typ: type, func: Any = None) -> Any: ...

    def pop(self, typ: type, default: Any = None) -> Any: ...


class _Formatters(Protocol):
    formatters: dict[str, _Formatter]


class Shell(Protocol):
    """The part of IPython's InteractiveShell that this module uses."""

    display_formatter: _Formatters


def show_messages(shell: Shell) -> None:
    """Make ``shell`` display messages as HTML."""
    shell.display_formatter.formatters["text/html"].for_type(genpy.Message, html_of)


def hide_messages(shell: Shell) -> None:
    """Make ``shell`` display messages as text again."""
    shell.display_formatter.formatters["text/html"].pop(genpy.Message, None)


def html_of(message: Any) -> str:
    """Format a message as an HTML table of its fields; for an image, add its picture above the table."""
    rows = []
    fields = list(leaves(type(message)))
    for path, type_ in fields[:_MAX_ROWS]:
        value: Any = message
        for name in path.split("."):
            value = getattr(value, name)
        rows.append(
            f"<tr><td style='text-align:left'>{escape(path)}</td><td style='text-align:left'>"
            f"{escape(_text_of(value))}</td><td style='text-align:left;opacity:.6'>{escape(type_)}</td></tr>"
        )
    if len(fields) > _MAX_ROWS:
        rows.append(f"<tr><td colspan=3>and {len(fields) - _MAX_ROWS} more fields</td></tr>")
    table = f"<table><caption>{escape(message._type)}</caption>{''.join(rows)}</table>"
    return _picture_of(message) + table


def _text_of(value: Any) -> str:
    if isinstance(value, bytes):
        text = f"{len(value)} bytes"
    elif isinstance(value, (list, tuple)):
        shown = ", ".join(str(each) for each in value[:_MAX_ITEMS])
        text = f"[{shown}]" if len(value) <= _MAX_ITEMS else f"[{shown}, ...] ({len(value)} values)"
    elif isinstance(value, genpy.Time):
        text = f"{value.secs}.{value.nsecs:09} s"
    elif isinstance(value, genpy.Duration):
        text = f"{value.to_nsec() / 1e9:.9f} s"
    else:
        text = str(value)
    return text if len(text) <= _MAX_TEXT else f"{text[:_MAX_TEXT]}..."


def _picture_of(message: Any) -> str:
    """Return an HTML element with an image message's picture or the reason why there is none; "" for other messages."""
    if message._type not in (IMAGE, COMPRESSED):
        return ""
    body = _Buffer()
    message.serialize(body)
    try:
        data, content_type = encoded(message._type, bytes(body.data), Picture(format="png"))
    except BridgeError as error:
        return f"<p>{escape(str(error))}</p>"
    source = f"data:{content_type};base64,{base64.b64encode(data).decode()}"
    return f"<img style='max-width:min(100%,{_MAX_WIDTH}px)' src='{source}'/>"


class _Buffer:
    """A buffer into which a message's ``serialize`` writes."""

    def __init__(self) -> None:
        self.data = bytearray()

    def write(self, data: bytes) -> None:
        self.data += data
