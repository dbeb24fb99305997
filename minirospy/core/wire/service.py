"""Requests and responses of a service, as TCPROS sends them after the connection headers.

A request is its length (4 bytes, little-endian) and its body; a response is one byte, 1 for success, the length, and its body
or, after a 0, the text of an error. Source: http://wiki.ros.org/ROS/TCPROS ("Services").
"""

from __future__ import annotations

import struct

from minirospy.base.errors import WireError
from minirospy.core.wire.framing import MAX_FRAME

__all__ = [
    "REQUEST_HEAD",
    "RESPONSE_HEAD",
    "parse_request_head",
    "parse_response_head",
    "serialize_failure",
    "serialize_request",
    "serialize_response",
]

_LENGTH = struct.Struct("<I")
_OK_LENGTH = struct.Struct("<BI")

REQUEST_HEAD = _LENGTH.size
"""Bytes in front of a request's body."""

RESPONSE_HEAD = _OK_LENGTH.size
"""Bytes in front of a response's body, or of the text of an error."""


def serialize_request(body: bytes) -> bytes:
    """Return what a client sends."""
    return _LENGTH.pack(len(body)) + body


def serialize_response(body: bytes) -> bytes:
    """Return what a server sends after a call that succeeded."""
    return _OK_LENGTH.pack(1, len(body)) + body


def serialize_failure(error: Exception) -> bytes:
    """Return what a server sends after a call that failed: the text of ``error``."""
    # An error's text may hold what UTF-8 does not, as part of a file's name.
    text = str(error).encode(errors="backslashreplace")
    return _OK_LENGTH.pack(0, len(text)) + text


def parse_request_head(head: bytes) -> int:
    """Return the length of the body behind these :data:`REQUEST_HEAD` bytes. Raise WireError if it is over the limit."""
    length: int = _LENGTH.unpack(head)[0]
    if length > MAX_FRAME:
        raise _too_long(length)
    return length


def parse_response_head(head: bytes) -> tuple[bool, int]:
    """Return whether the call succeeded, and the length of what follows. Raise WireError if it is over the limit."""
    ok, length = _OK_LENGTH.unpack(head)
    if length > MAX_FRAME:
        raise _too_long(length)
    return ok != 0, length


def _too_long(length: int) -> WireError:
    return WireError(f"a body of {length} bytes is over the limit of {MAX_FRAME}")
