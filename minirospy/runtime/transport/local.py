"""Connections between two processes of one machine, over a Unix socket in place of TCP.

Each port of a server has a socket of Linux' abstract kind, whose name is made of the server's host and
port: no file, so nothing is left behind, however a process ends. It is seen by those that share the machine's
network, as the port is. Source: docs/transports.md.
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
_PREFIX = "minirospy-"
"""How the names of sockets start."""

_TRUSTED = frozenset({0})
"""Users that are trusted besides this process's own: root."""


class UnixAddress(NamedTuple):
    """A publisher's answer: the socket's name, and where TCPROS is served for one who cannot reach it."""

    name: str
    host: str
    port: int


def this_host() -> str:
    """Return a text that two processes share if, and only if, abstract sockets connect them; "" where there are none."""
    if sys.platform != "linux":
        return ""
    try:
        with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:
            return f"{file.read().strip()}/{os.stat('/proc/self/ns/net').st_ino}"
    except OSError:
        return ""


def name_of(host: str, port: int) -> str:
    """Return the name of the socket beside ``port`` of a server that is known as ``host``."""
    host = host.strip("[]").lower()
    return f"{_PREFIX}{'127.0.0.1' if host == 'localhost' else host}:{port}"


def bind(host: str, port: int) -> socket.socket | None:
    """Return the socket beside ``port`` of a server that is known as ``host``; None if there can be none."""
    if sys.platform != "linux":
        return None
    try:
        return _open(name_of(host, port), lambda sock, address: sock.bind(address))
    except OSError:
        return None


def connect(name: str) -> socket.socket:
    """Return a connected, non-blocking socket; a Unix socket needs no waiting. Raise OSError."""
    return _open(name, lambda sock, address: sock.connect(address))


def reach(host: str, port: int) -> socket.socket | None:
    """Return a connected, non-blocking socket to the server of ``host`` at ``port``; None if only TCP reaches it.

    Other users of this machine could take a name before its server does: so the server is this user's or root's.
    """
    if sys.platform != "linux":
        return None
    try:
        sock = connect(name_of(host, port))
    except OSError:
        return None
    user = sockets.peer(sock).user
    if user not in _TRUSTED and user != os.geteuid():
        sock.close()
        return None
    return sock


def parse_answer(answer: object) -> UnixAddress | None:
    """Return the address out of a publisher's answer to requestTopic; None if it is of another protocol."""
    match answer:
        # A peer must not choose any other socket of this machine, such as a display's or a message bus's.
        case [1, _, ["UNIXROS", str(name), str(host), int(port), *_]] if name.startswith(_PREFIX):
            return UnixAddress(name, host, port)
        case _:
            return None


def _open(name: str, use: Callable[[socket.socket, bytes], None]) -> socket.socket:
    """Return a non-blocking socket, bound or connected to ``name``. Raise OSError."""
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        sock.setblocking(False)
        # A zero byte makes it abstract. As UTF-8 in any locale: the two ends may have different ones.
        use(sock, b"\0" + name.encode(errors="surrogatepass"))
    except BaseException:
        sock.close()
        raise
    return sock
