"""A service's requests and responses, which TCPROS sends after the connection headers.

A request is its length (4 bytes, little-endian) and its body. A response is the byte 1 for success, the length, and the
body; or the byte 0, the length, and an error message. Source: http://wiki.ros.org/ROS/TCPROS ("Services").
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

REQUEST_HEAD = _LENGTH.size  # bytes before a request's body

RESPONSE_HEAD = _OK_LENGTH.size  # bytes before a response's body, or before an error message


def serialize_request(body: bytes) -> bytes:
    """Serialize a client's request."""
    return _LENGTH.pack(len(body)) + body


def serialize_response(body: bytes) -> bytes:
    """Serialize a server's response to a successful call."""
    return _OK_LENGTH.pack(1, len(body)) + body


def serialize_failure(error: Exception) -> bytes:
    """Serialize a server's response to a failed call, with the message of ``error``."""
    # An error message, for example one with a file name, may contain characters that UTF-8 cannot encode.
    text = str(error).encode(errors="backslashreplace")
    return _OK_LENGTH.pack(0, len(text)) + text


def parse_request_head(head: bytes) -> int:
    """Return the length of the body that follows ``head``. Raise WireError if it exceeds the limit."""
    length: int = _LENGTH.unpack(head)[0]
    if length > MAX_FRAME:
        raise _too_long(length)
    return length


def parse_response_head(head: bytes) -> tuple[bool, int]:
    """Return whether the call succeeded, and the length of what follows. Raise WireError if the length exceeds the limit."""
    ok, length = _OK_LENGTH.unpack(head)
    if length > MAX_FRAME:
        raise _too_long(length)
    return ok != 0, length


def _too_long(length: int) -> WireError:
    return WireError(f"a body of {length} bytes is over the limit of {MAX_FRAME}")
