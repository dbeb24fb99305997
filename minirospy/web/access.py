"""Access control: checks a request's Host, Origin and token, and filters names of topics, services and parameters.

Pure. On loopback, every user of this machine may connect, but no page from another site: a browser sends the page's
site in ``Origin``, and the host name that it resolved in ``Host`` (which reveals DNS rebinding). Beyond loopback, a
token is required. Source: RFC 6455, section 10.2 (Origin).
"""

from __future__ import annotations

import fnmatch
import hmac
import ipaddress
import re
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple
from urllib.parse import parse_qs, urlsplit

from minirospy.base.errors import BridgeError

__all__ = [
    "TOKEN_PROTOCOL",
    "Access",
    "Credentials",
    "Grant",
    "Refusal",
    "is_loopback",
    "is_token",
    "new_token",
]

TOKEN_PROTOCOL = "minirospy.token."
"""Prefix of a sub-protocol that carries a token, because a page can choose sub-protocols but not set WebSocket headers."""

DESKTOP_ORIGINS = ("file://", "lichtblick://*", "foxglove://*", "app://*", "vscode-webview://*")
APP_ORIGINS = (
    "https://app.foxglove.dev",
    "https://studio.foxglove.dev",
    "https://lichtblick-suite.github.io",
)
"""Origins of the front ends' pages. A browser sends these origins only for those pages."""

_LOCAL_NAMES = ("localhost",)
_TOKEN = re.compile(r"[A-Za-z0-9_-]{8,200}")


class Grant(Enum):
    """The rights of a client."""

    READ = "read-only"
    WRITE = "read-write"
    OWN = "read-write, with the token"
    """The client has the user's token, so it may also start programs, and open files as the server's user."""


class Refusal(NamedTuple):
    """Why a request is refused: the HTTP status, and one line for the user.

    ``names_option``: the text names an option of the bridge. Only the bridge's terminal shows it, for the bridge's owner.
    """

    status: int
    text: str
    names_option: bool = False


class Credentials(NamedTuple):
    """The parts of a request that identify its sender: the Host, Origin and Authorization headers, sub-protocols and target."""

    host: str
    origin: str | None
    authorization: str
    subprotocols: Sequence[str]
    target: str

    @property
    def token(self) -> str:
        """Return the token in the header, a sub-protocol or the query, or "" if there is none."""
        scheme, _, rest = self.authorization.partition(" ")
        if scheme.lower() == "bearer":
            return rest.strip()
        for name in self.subprotocols:
            if name.startswith(TOKEN_PROTOCOL):
                return name.removeprefix(TOKEN_PROTOCOL)
        found = parse_qs(urlsplit(self.target).query, max_num_fields=50).get("token", [""])
        return found[0]


@dataclass(frozen=True)
class Access:
    """The rules for access to one listener.

    ``hosts``: names of this machine in addition to addresses and localhost. ``origins``: patterns for pages that may
    connect in addition to those from this machine and the front ends. A token is "" if there is none. ``requires_token``
    is set for a listener that is not on loopback. ``default_is_read``: clients that need no token have read-only access.
    ``file_option``: the option that lets pages of files connect, for the text of the refusal.
    """

    hosts: tuple[str, ...] = ()
    origins: tuple[str, ...] = ()
    read_token: str = ""
    write_token: str = ""
    requires_token: bool = False
    default_is_read: bool = False
    file_option: str = "--origin null"

    def __post_init__(self) -> None:
        for token in (self.read_token, self.write_token):
            if token and not is_token(token):
                raise BridgeError("a token has 8 to 200 characters out of A-Z a-z 0-9 _ -")
        if self.requires_token and not (self.read_token or self.write_token):
            raise BridgeError("a listener beyond loopback needs a token")

    def check(self, request: Credentials) -> Grant | Refusal:
        """Return the rights of the sender of a request, or the reason for refusing it."""
        if refusal := self.check_host(request.host):
            return refusal
        grant = self._grant_of(request.token)
        if grant:
            # The user has given this page the token, so any origin is accepted.
            return grant

        if request.token and (self.read_token or self.write_token):
            return Refusal(401, "this token is wrong: the bridge prints the right one when it starts")
        if self.requires_token:
            return Refusal(401, "a token is required: the bridge prints it when it starts")
        if not self._knows_origin(request.origin, request.host):
            return Refusal(403, self._origin_text(request.origin or ""), names_option=True)
        return Grant.READ if self.default_is_read else Grant.WRITE

    def check_host(self, host: str) -> Refusal | None:
        """Return the reason for refusing a Host header, or None if it is allowed."""
        if self._knows_host(host):
            return None
        return Refusal(
            403,
            f"Host '{host[:100]}' is not a name of this server: use its address, or start the bridge with "
            "--host-name NAME",
            names_option=True,
        )

    def _origin_text(self, origin: str) -> str:
        if origin == "null":
            return (
                "a page that was opened from a file (Origin: null) may not connect: start the bridge with "
                f"{self.file_option}"
            )
        return f"pages of '{origin[:100]}' may not connect: start the bridge with --origin PATTERN"

    def _grant_of(self, token: str) -> Grant | None:
        given = token.encode()
        # Always compare with both tokens, so that the response time does not reveal which one matches.
        is_write = bool(self.write_token) and hmac.compare_digest(given, self.write_token.encode())
        is_read = bool(self.read_token) and hmac.compare_digest(given, self.read_token.encode())
        return Grant.OWN if is_write else Grant.READ if is_read else None

    def _knows_host(self, host: str) -> bool:
        name = _host_name(host)
        if name in _LOCAL_NAMES or name.endswith(".localhost"):
            return True
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return name in {each.lower() for each in self.hosts}
        return True

    def _knows_origin(self, origin: str | None, host: str) -> bool:
        if origin is None:
            return True  # no web page has sent this request
        lowered = origin.lower()
        parts = urlsplit(lowered)
        if parts.scheme in ("http", "https") and (
            parts.netloc == host.lower() or is_loopback(parts.hostname or "")
        ):
            return True
        patterns = (*DESKTOP_ORIGINS, *APP_ORIGINS, *self.origins)
        return any(fnmatch.fnmatchcase(lowered, pattern.lower()) for pattern in patterns)


def new_token() -> str:
    """Return a random 128-bit token."""
    return secrets.token_urlsafe(16)


def is_token(value: object) -> bool:
    """Return whether a value is a string with the length and characters of a token."""
    return isinstance(value, str) and bool(_TOKEN.fullmatch(value))


def is_loopback(host: str) -> bool:
    """Return whether a host is localhost or a loopback address."""
    if host in _LOCAL_NAMES or host.endswith(".localhost"):
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def header_items(headers: Mapping[str, str], name: str) -> list[str]:
    """Split a header's comma-separated value into its items."""
    return [item.strip() for item in headers.get(name, "").split(",") if item.strip()]


def _host_name(host: str) -> str:
    """Return the host name or address in a Host header, without the port."""
    try:
        return (urlsplit(f"//{host}").hostname or "").lower()
    except ValueError:
        return ""
