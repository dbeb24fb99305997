"""Functions for this machine's addresses and for connection headers, as in ROS's rosgraph.network.

Source: http://wiki.ros.org/ROS/NetworkSetup, http://wiki.ros.org/ROS/TCPROS.
"""

from __future__ import annotations

import os
import socket
import struct
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from minirospy.base.environment import Environment, is_local
from minirospy.base.errors import WireError
from minirospy.core.wire.framing import LENGTH_BYTES, parse_length
from minirospy.core.wire.header import parse_header
from minirospy.ros.rosgraph.rosgraph.rosenv import ROS_HOSTNAME, ROS_IP, ROS_IPV6

if TYPE_CHECKING:
    from io import BytesIO

__all__ = [
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_IPV6",
    "ROSHandshakeException",
    "create_local_xmlrpc_uri",
    "decode_ros_handshake_header",
    "encode_ros_handshake_header",
    "get_address_override",
    "get_bind_address",
    "get_host_name",
    "get_local_address",
    "get_local_addresses",
    "is_local_address",
    "parse_http_host_and_port",
    "read_ros_handshake_header",
    "use_ipv6",
    "write_ros_handshake_header",
]


class ROSHandshakeException(Exception):
    """Raised if a connection header is incomplete or cannot be parsed."""


def get_address_override() -> str | None:
    """Return the value of ``__hostname:=``, ``__ip:=``, ROS_HOSTNAME or ROS_IP, or None if none is set.

    With MINIROSPY_LOCAL=1, return localhost. Programs may change sys.argv and the environment at any time, so both are read
    at each call. Raise ValueError if the argument contains a second ``:=``.
    """
    if is_local(os.environ):
        return "localhost"
    for argument in sys.argv:
        if argument.startswith(("__hostname:=", "__ip:=")):
            if argument.count(":=") > 1:
                raise ValueError(f"invalid ROS command-line remapping argument '{argument}'")
            return argument.partition(":=")[2]
    return os.environ.get(ROS_HOSTNAME) or os.environ.get(ROS_IP) or None


def get_host_name() -> str:
    """Return the host name that other nodes use for this machine."""
    return _environment().host


def _environment() -> Environment:
    return Environment.read(host=get_address_override() or "")


def get_local_address() -> str:
    """Return the address that other nodes use for this machine."""
    host = get_address_override()
    if host:
        return host
    return next((each for each in get_local_addresses() if not each.startswith("127.")), "127.0.0.1")


def get_local_addresses() -> list[str]:
    """Return this machine's addresses, including IPv6 addresses if ROS_IPV6 is on."""
    import psutil

    families = {socket.AF_INET, socket.AF_INET6} if use_ipv6() else {socket.AF_INET}
    interfaces = psutil.net_if_addrs().values()
    return [
        each.address.partition("%")[0] for found in interfaces for each in found if each.family in families
    ]


def is_local_address(hostname: str) -> bool:
    """Return whether a host name refers to this machine."""
    try:
        found = {str(info[4][0]) for info in socket.getaddrinfo(hostname, 0, 0, 0, socket.SOL_TCP)}
    except OSError:
        return False
    return bool(found & set(get_local_addresses())) or any(
        each.startswith("127.") or each == "::1" for each in found
    )


def use_ipv6() -> bool:
    """Return whether ROS_IPV6 is on."""
    return Environment.read(host="localhost").ipv6


def get_bind_address(address: str | None = None) -> str:
    """Return the address for servers to bind to."""
    return (Environment.read(host=address) if address else _environment()).bind_host


def create_local_xmlrpc_uri(port: int) -> str:
    """Return the XML-RPC URI for a server on this machine."""
    return f"http://{_environment().uri_host}:{port}/"


def parse_http_host_and_port(url: str) -> tuple[str, int]:
    """Return a URL's (host, port); the port defaults to 80. Raise ValueError if the URL is invalid."""
    from urllib.parse import urlsplit

    if not url:
        raise ValueError("not a valid URL")
    parts = urlsplit(url)
    if not parts.hostname:
        raise ValueError("not a valid URL")
    return parts.hostname, parts.port or 80


def encode_ros_handshake_header(header: Mapping[str, object]) -> bytes:
    """Return a serialized connection header with its length prefix and sorted fields.

    Raise TypeError if a name or value is neither str nor bytes.
    """
    pairs = sorted((_as_bytes(name), _as_bytes(value)) for name, value in header.items())
    fields = [name + b"=" + value for name, value in pairs]
    body = b"".join(struct.pack("<I", len(field)) + field for field in fields)
    return struct.pack("<I", len(body)) + body


def _as_bytes(text: object) -> bytes:
    if isinstance(text, str):
        return text.encode()
    if isinstance(text, bytes):
        return text
    raise TypeError(f"a connection header has str or bytes, not {type(text).__name__}")


def decode_ros_handshake_header(header_str: bytes) -> dict[str, str]:
    """Return the fields in a connection header, given with its length prefix.

    Raise ROSHandshakeException or struct.error if the header cannot be parsed.
    """
    (size,) = struct.unpack("<I", header_str[:LENGTH_BYTES])
    body = header_str[LENGTH_BYTES : LENGTH_BYTES + size]
    if len(body) < size:
        raise ROSHandshakeException(
            f"Incomplete header. Expected {size + LENGTH_BYTES} bytes but only have {len(header_str)}"
        )
    try:
        return dict(parse_header(body))
    except WireError as error:
        raise ROSHandshakeException(str(error)) from error


def read_ros_handshake_header(sock: socket.socket, b: BytesIO, buff_size: int) -> dict[str, str]:
    """Read a connection header from a socket; bytes received after it remain in the buffer ``b``.

    Raise ROSHandshakeException if the peer closes the connection before the end of the header.
    """
    data = b.getvalue()
    while len(data) < LENGTH_BYTES or len(data) < LENGTH_BYTES + parse_length(data):
        more = sock.recv(buff_size)
        if not more:
            raise ROSHandshakeException(
                "connection from sender terminated before handshake header received. "
                f"{len(data)} bytes were received. Please check sender for additional details."
            )
        data += more
    end = LENGTH_BYTES + parse_length(data)
    b.seek(0)
    b.truncate(0)
    b.write(data[end:])
    b.seek(0)
    return decode_ros_handshake_header(data[:end])


def write_ros_handshake_header(sock: socket.socket, header: Mapping[str, object]) -> int:
    """Send a connection header; return its size in bytes."""
    data = encode_ros_handshake_header(header)
    sock.sendall(data)
    return len(data)
