"""One-time codes that the local browser exchanges for the token, so that the token is never in a file or a command line.

A code is valid once, for a minute, and is stored in a file that only this user can read (browser.py). On Linux the
connection that sends it must also belong to this user or to root; a connection whose owner is unknown is refused. On
other systems the code alone is sufficient, because an unprivileged program cannot read a table of connections there.
"""

from __future__ import annotations

import os
import secrets
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from minirospy.web.server.owners import owner_of

if TYPE_CHECKING:
    from minirospy.web.server.client import Exchange, HttpRequest

__all__ = ["LIFETIME", "Codes"]

LIFETIME = 60.0  # seconds; the browser starts immediately, and sends its code within a few seconds
ROOT_UID = 0


def _nothing() -> None:
    """Do nothing."""


class _Code(NamedTuple):
    token: str
    end: float
    on_end: Callable[[], object] = _nothing


class Codes:
    """One-time codes that have not been used. Runs on the loop."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._waiting: dict[str, _Code] = {}

    def new(self, token: str) -> str:
        """Return a new code for a token."""
        self.forget_expired()
        code = secrets.token_urlsafe(16)
        self._waiting[code] = _Code(token, self._clock() + LIFETIME)
        return code

    def when_ended(self, code: str, action: Callable[[], object]) -> None:
        """Call ``action`` once: when the code is used, expires or is discarded."""
        found = self._waiting.get(code)
        if found:
            self._waiting[code] = found._replace(on_end=action)
        else:
            action()

    def token_of(self, code: str) -> str:
        """Return a code's token without using up the code, or "" if the code is invalid."""
        self.forget_expired()
        found = self._waiting.get(code)
        return found.token if found else ""

    def redeem(self, code: str) -> str:
        """Return a code's token and invalidate the code, or return "" if the code is invalid."""
        token = self.token_of(code)
        self._forget(code)
        return token

    def forget_expired(self) -> None:
        """Discard all expired codes."""
        now = self._clock()
        for code in [code for code, found in self._waiting.items() if now >= found.end]:
            self._forget(code)

    def close(self) -> None:
        """Discard all codes. Idempotent."""
        for code in list(self._waiting):
            self._forget(code)

    def serve(self, exchange: Exchange) -> None:
        """Respond with the token to a page that sends a code as its bearer token. A refused request does not use up the code."""
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
    """Return whether this user or root has sent a request; on systems other than Linux, always return True."""
    if sys.platform != "linux":
        return True
    return owner_of((request.peer, request.peer_port), (request.address, request.port)) in (
        ROOT_UID,
        os.getuid(),
    )
