"""Codes that the browser of this machine exchanges for the token: the token itself is never in a file or a command line.

A code is valid once, for a minute. It is in a file that only this user can read (browser.py). On Linux the connection that sends
it must also belong to this user or to root; a connection without a known owner is refused. Other systems have no table
of connections that an unprivileged program can read: there the code alone decides.
"""

from __future__ import annotations

import ipaddress
import os
import secrets
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from minirospy.bridge.web.client import Exchange, HttpRequest

__all__ = ["LIFETIME", "Codes", "owner_of"]

LIFETIME = 60.0  # seconds; the browser is started immediately, and asks within a few
_TABLES = (Path("/proc/net/tcp"), Path("/proc/net/tcp6"))
_ROOT = 0

_Address = ipaddress.IPv4Address | ipaddress.IPv6Address


def _nothing() -> None:
    """Do nothing."""


class _Code(NamedTuple):
    token: str
    end: float
    on_end: Callable[[], object] = _nothing


class Codes:
    """The codes that have not been used. On the loop."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._waiting: dict[str, _Code] = {}

    def new(self, token: str) -> str:
        """Return a code for a token."""
        self.forget_expired()
        code = secrets.token_urlsafe(16)
        self._waiting[code] = _Code(token, self._clock() + LIFETIME)
        return code

    def when_ended(self, code: str, action: Callable[[], object]) -> None:
        """Call ``action`` once, when a code has been used, has expired or is forgotten."""
        found = self._waiting.get(code)
        if found:
            self._waiting[code] = found._replace(on_end=action)
        else:
            action()

    def token_of(self, code: str) -> str:
        """Return the token of a code, which stays valid; "" if there is none."""
        self.forget_expired()
        found = self._waiting.get(code)
        return found.token if found else ""

    def redeem(self, code: str) -> str:
        """Return the token of a code, which is valid no longer; "" if there is none."""
        token = self.token_of(code)
        self._forget(code)
        return token

    def forget_expired(self) -> None:
        """Forget the codes whose time is over."""
        now = self._clock()
        for code in [code for code, found in self._waiting.items() if now >= found.end]:
            self._forget(code)

    def close(self) -> None:
        """Forget all codes. Idempotent."""
        for code in list(self._waiting):
            self._forget(code)

    def serve(self, exchange: Exchange) -> None:
        """Answer the page that sends a code as a bearer token. A refused request leaves the code valid."""
        code = exchange.request.headers.get("authorization", "").removeprefix("Bearer ")
        if not self.token_of(code):
            exchange.respond(403, b"this link has been used\n")
        elif not _is_trusted(exchange.request):
            exchange.respond(403, b"this code is for the user who started the dashboard, on this machine\n")
        else:
            exchange.respond(200, self.redeem(code).encode())

    def _forget(self, code: str) -> None:
        found = self._waiting.pop(code, None)
        if found:
            found.on_end()


def _is_trusted(request: HttpRequest) -> bool:
    """Return whether a request is from this user or root; on other systems than Linux the code is the only proof."""
    if sys.platform != "linux":
        return True
    return owner_of((request.peer, request.peer_port), (request.address, request.port)) in (
        _ROOT,
        os.getuid(),
    )


def owner_of(end: tuple[str, int], other_end: tuple[str, int]) -> int | None:
    """Return the user of the TCP socket of this machine at ``end`` that is connected to ``other_end``, in any state.

    Return None if there is no such socket, or if no process has it open any more: the kernel lists those as root's.
    Source: proc_net_tcp of the kernel's documentation.
    """
    try:
        wanted = _parsed(end), _parsed(other_end)
    except ValueError:
        return None
    for table in _TABLES:
        try:
            lines = table.read_text(encoding="ascii").splitlines()[1:]
        except (OSError, ValueError):
            continue
        port = f":{end[1]:04X} "
        for line in lines:
            if port not in line:
                continue  # most of thousands, without parsing
            _, local, remote, _, _, _, _, user, _, inode, *_ = line.split()
            if (_listed(local), _listed(remote)) == wanted and inode != "0":
                return int(user)
    return None


def _parsed(end: tuple[str, int]) -> tuple[_Address, int]:
    """Return an address as the socket API has it, and its port. Raise ValueError."""
    return _unmapped(ipaddress.ip_address(end[0].partition("%")[0])), end[1]


def _listed(text: str) -> tuple[_Address, int]:
    """Return an address and a port of the kernel's table: words of 32 bits in the byte order of the machine."""
    host, _, port = text.partition(":")
    words = [int(host[at : at + 8], 16).to_bytes(4, sys.byteorder) for at in range(0, len(host), 8)]
    return _unmapped(ipaddress.ip_address(b"".join(words))), int(port, 16)


def _unmapped(address: _Address) -> _Address:
    """Return the IPv4 address in an IPv6 address that has one: a socket of IPv6 may be connected by IPv4."""
    return (address.ipv4_mapped or address) if isinstance(address, ipaddress.IPv6Address) else address
