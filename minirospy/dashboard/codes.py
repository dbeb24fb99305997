"""Codes in place of the token in the link that a browser is started with: any user of the machine may list command lines.

A code is exchanged for the token once, within a minute, on Linux only by a process of the same user or of root. Elsewhere another
user who is faster than the browser gets it: then the page lacks the rights of the token.
"""

from __future__ import annotations

import os
import secrets
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.bridge.web.client import Exchange

__all__ = ["Codes", "users_of"]

_SECONDS = 60.0
_TABLES = ("/proc/net/tcp", "/proc/net/tcp6")
_ESTABLISHED = "01"


class Codes:
    """The codes that have not been used. On the loop."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._waiting: dict[str, tuple[str, float]] = {}

    def new(self, token: str) -> str:
        """Return a code for a token."""
        code = secrets.token_urlsafe(16)
        self._waiting[code] = token, self._clock() + _SECONDS
        return code

    def redeem(self, code: str) -> str:
        """Return the token of a code, which is used with that; "" where there is none."""
        token, end = self._waiting.pop(code, ("", 0.0))
        return token if self._clock() < end else ""

    def serve(self, exchange: Exchange) -> None:
        """Answer the page that sends a code as a bearer token."""
        code = exchange.request.headers.get("authorization", "").removeprefix("Bearer ")
        token = self.redeem(code)
        if token and users_of(exchange.request.peer_port, exchange.request.port) <= {0, _user()}:
            exchange.respond(200, token.encode())
        else:
            exchange.respond(403, b"this link has been used\n")


def _user() -> int:
    return os.getuid() if sys.platform != "win32" else 0


def users_of(port: int, peer_port: int) -> set[int]:
    """Return the users of the sockets on this machine that have a port and are connected to the other, as far as that is known.

    Source: proc_net_tcp of the kernel's documentation.
    """
    found = set()
    for table in _TABLES:
        try:
            lines = Path(table).read_text(encoding="ascii").splitlines()[1:]
        except (OSError, ValueError):
            continue
        for line in lines:
            _, local, remote, state, *rest = line.split()
            ports = [int(each.rpartition(":")[2], 16) for each in (local, remote)]
            if ports == [port, peer_port] and state == _ESTABLISHED:
                found.add(int(rest[3]))
    return found
