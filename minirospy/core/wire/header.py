"""The connection header: the ``field=value`` pairs at the start of every TCPROS connection.

Converts fields to bytes and back. Source: http://wiki.ros.org/ROS/Connection%20Header.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping

from minirospy.base.errors import WireError

__all__ = ["MAX_HEADER", "Header", "parse_header", "serialize_header"]

Header = dict[str, str]

MAX_HEADER = 4 * 1024 * 1024  # maximum bytes in a header; the largest full texts have about 20 kB

_LENGTH = struct.Struct("<I")


def serialize_header(fields: Mapping[str, str]) -> bytes:
    """Serialize the header with its length prefix. The fields are sorted as in rospy and roscpp."""
    pairs = [f"{name}={fields[name]}".encode() for name in sorted(fields)]
    body = b"".join(_LENGTH.pack(len(pair)) + pair for pair in pairs)
    return _LENGTH.pack(len(body)) + body


def parse_header(body: bytes) -> Header:
    """Parse a header (without its length prefix) into its fields. Raise WireError if it is invalid."""
    fields: Header = {}
    at = 0
    while at < len(body):
        if at + 4 > len(body):
            raise WireError("connection header ends inside a field's length")
        (length,) = _LENGTH.unpack_from(body, at)
        at += 4
        if at + length > len(body):
            raise WireError(f"connection header's field of {length} bytes is longer than the header")
        name, separator, value = body[at : at + length].partition(b"=")
        at += length
        if not separator:
            raise WireError(f"connection header's field {name[:40]!r} has no '='")
        # Accept names and definitions in any encoding: third-party nodes send them, for example in a definition's comment.
        fields[name.decode("utf-8", "replace")] = value.decode("utf-8", "replace")
    return fields
