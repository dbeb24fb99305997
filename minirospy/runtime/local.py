"""UNIXROS: a topic's connection between two processes of one machine, over a Unix socket.

The socket has a name of Linux' abstract kind: no file, so nothing is left behind, however a process ends. It
is seen by those that share the machine's network, and :func:`this_host` tells whether two processes do.
Source: docs/transports.md.
"""

from __future__ import annotations

import os
import socket
import sys
from typing import Any, NamedTuple

__all__ = ["PROTOCOL", "UnixAddress", "bind", "connect", "name_of", "parse_answer", "this_host"]

PROTOCOL = "UNIXROS"
_ABSTRACT = "\0"


class UnixAddress(NamedTuple):
    """A publisher's answer: the socket's name, and where TCPROS is served for one who cannot reach it."""

    name: str
    host: str
    port: int


def this_host() -> str:
    """What is the same for two processes if, and only if, abstract sockets join them; "" where there are none."""
    if sys.platform != "linux":
        return ""
    try:
        with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:
            return f"{file.read().strip()}/{os.stat('/proc/self/ns/net').st_ino}"
    except OSError:
        return ""


def bind() -> socket.socket:
    """A Unix socket of a name that nobody else has. Raises OSError."""
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        sock.setblocking(False)
        sock.bind(f"{_ABSTRACT}minirospy-{os.getpid()}-{os.urandom(8).hex()}")
    except BaseException:
        sock.close()
        raise
    return sock


def name_of(sock: socket.socket) -> str:
    """The name that peers are told of a bound socket."""
    name = sock.getsockname()
    return (name.decode() if isinstance(name, bytes) else str(name)).removeprefix(_ABSTRACT)


def connect(name: str) -> socket.socket:
    """A connected, non-blocking socket; a Unix socket needs no waiting. Raises OSError."""
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    sock.setblocking(False)
    try:
        sock.connect(_ABSTRACT + name)
    except BaseException:
        sock.close()
        raise
    return sock


def parse_answer(answer: Any) -> UnixAddress | None:
    """The address out of a publisher's answer to requestTopic; None where it is of another protocol."""
    match answer:
        case [1, _, ["UNIXROS", str(name), str(host), int(port), *_]]:
            return UnixAddress(name, host, port)
        case _:
            return None
