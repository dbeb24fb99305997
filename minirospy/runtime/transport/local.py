"""Connections between two processes on one machine, through a Unix socket instead of TCP.

Each server port has a Linux abstract socket, whose name is derived from the server's host and port. The socket is not a
file, so nothing is left behind when a process is killed. Like the port, the socket is visible to processes in the same
network namespace. Source: docs/transports.md.
"""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Callable
from typing import NamedTuple

from minirospy.runtime.transport import sockets

__all__ = ["PROTOCOL", "UnixAddress", "bind", "connect", "name_of", "parse_answer", "reach", "this_host"]

PROTOCOL = "UNIXROS"
_PREFIX = "minirospy-"  # the prefix of socket names

TRUSTED_USERS = frozenset({0})  # trusted user ids in addition to this process's own: root


class UnixAddress(NamedTuple):
    """A publisher's response: the socket's name, and the TCPROS address as a fallback."""

    name: str
    host: str
    port: int


def this_host() -> str:
    """Return a string that two processes share if and only if abstract sockets can connect them; "" if unsupported."""
    if sys.platform != "linux":
        return ""
    try:
        with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:
            return f"{file.read().strip()}/{os.stat('/proc/self/ns/net').st_ino}"
    except OSError:
        return ""


def name_of(host: str, port: int) -> str:
    """Return the name of the socket for ``port`` on a server known as ``host``."""
    host = host.strip("[]").lower()
    return f"{_PREFIX}{'127.0.0.1' if host == 'localhost' else host}:{port}"


def bind(host: str, port: int) -> socket.socket | None:
    """Bind a socket for ``port`` on a server known as ``host`` and return it, or None if that is not possible."""
    if sys.platform != "linux":
        return None
    try:
        return _open(name_of(host, port), lambda sock, address: sock.bind(address))
    except OSError:
        return None


def connect(name: str) -> socket.socket:
    """Connect to the socket ``name``; return it in non-blocking mode. This does not block. Raise OSError if nothing listens."""
    return _open(name, lambda sock, address: sock.connect(address))


def reach(host: str, port: int) -> socket.socket | None:
    """Connect to the Unix socket of the server at ``host`` and ``port``; return it in non-blocking mode, or None if this fails.

    Another user on this machine could bind the name first, so the server must belong to this user or root.
    """
    if sys.platform != "linux":
        return None
    try:
        sock = connect(name_of(host, port))
    except OSError:
        return None
    user = sockets.peer(sock).user
    if user not in TRUSTED_USERS and user != os.geteuid():
        sock.close()
        return None
    return sock


def parse_answer(answer: object) -> UnixAddress | None:
    """Parse the address in a publisher's response to requestTopic. Return None if the response is for another protocol."""
    match answer:
        # A peer must not be able to choose any other socket on this machine, for example a display's or a message bus's.
        case [1, _, ["UNIXROS", str(name), str(host), int(port), *_]] if name.startswith(_PREFIX):
            return UnixAddress(name, host, port)
        case _:
            return None


def _open(name: str, use: Callable[[socket.socket, bytes], None]) -> socket.socket:
    """Return a non-blocking socket that is bound or connected to ``name``. Raise OSError if that fails."""
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        sock.setblocking(False)
        # A leading zero byte makes the socket abstract. Always use UTF-8, because the two processes may have different locales.
        use(sock, b"\0" + name.encode(errors="surrogatepass"))
    except BaseException:
        sock.close()
        raise
    return sock
