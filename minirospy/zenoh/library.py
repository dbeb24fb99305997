"""The Zenoh library for all bridges: protocol classes for its API, which has no type hints, and a session's configuration."""

from __future__ import annotations

import importlib
import importlib.metadata
import ipaddress
import json
import os
import re
import socket
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from minirospy.base.errors import BridgeError
from minirospy.base.escape import escaped, has_controls
from minirospy.base.installation import install_command

__all__ = [
    "DEFAULT_ENDPOINT", "DEFAULT_PORT", "Bytes", "Config", "Declared", "EndpointError",
    "Matching", "NetworkOptions", "Outlet", "Query", "Reply",
    "Sample", "Session", "configured", "is_loopback_endpoint", "one_line", "require_zenoh", "to_endpoint",
    "unresolved",
]  # fmt: skip

DEFAULT_PORT = 7447
DEFAULT_ENDPOINT = f"tcp/127.0.0.1:{DEFAULT_PORT}"
MAX_PORT = 65_535
_MAX_PORT_DIGITS = 5
INTERNET_PROTOCOLS = frozenset({"quic", "quic_datagram", "tcp", "tls", "udp", "ws", "wss"})
PROTOCOLS = INTERNET_PROTOCOLS | {"serial", "shm", "unixpipe", "unixsock-stream", "vsock"}
"""Link protocols of Zenoh. Zenoh itself reports an error if it was built without a protocol that is used."""
_HOST = re.compile(r"[\w*][\w.*%-]*|\[[0-9A-Fa-f:.]+(%[\w.-]+)?\]")
_SESSIONS = 10_000
_SEND_BUFFER = 65_536
_POOLS = {"rx": 256, "acc": 32, "app": 32, "tx": 32, "net": 32}
_THREADS = f"({', '.join(f'{pool}: (worker_threads: {count})' for pool, count in _POOLS.items())})"
"""Value of ZENOH_RUNTIME. Many threads receive, because Zenoh sets SO_LINGER to 10 s: closing a dead link blocks a thread.

`linger.py` removes that option, except on Windows, but Zenoh may close a link before that. Measured without `linger.py`: the
simultaneous loss of 100 robots was noticed after 30 s with 32 threads in rx, and after 11 s with 128 threads. The lease is
10 s. The pool has twice as many threads, for larger fleets.
"""
CONNECT_MS = 3000


class EndpointError(BridgeError):
    """Raised for an endpoint argument that can never work."""

    def __init__(self, endpoint: str, reason: str) -> None:
        super().__init__(f"[{escaped(endpoint)}] {reason}")


# --- interfaces of the parts of zenoh that are used (untyped, because zenoh may not be installed)


class Bytes(Protocol):
    """The bytes of a payload or an attachment."""

    def to_bytes(self) -> bytes: ...

    def __len__(self) -> int: ...


class Sample(Protocol):
    """A message, a reply, or the appearance or disappearance of a liveliness token."""

    key_expr: object
    payload: Bytes
    kind: object
    attachment: Bytes | None


class _ReplyError(Protocol):
    payload: Bytes


class Reply(Protocol):
    """A reply to a query."""

    ok: Sample | None
    err: _ReplyError | None


class Query(Protocol):
    """A query received from a peer."""

    key_expr: object
    payload: Bytes | None
    attachment: Bytes | None

    def reply(self, key_expr: object, payload: bytes, *, attachment: bytes = ...) -> None: ...

    def reply_err(self, payload: bytes) -> None: ...

    def drop(self) -> None: ...


class Declared(Protocol):
    """A declaration that can be undeclared, such as a subscriber."""

    def undeclare(self) -> None: ...


class Matching(Protocol):
    """The matching status of a publisher: whether it has subscribers."""

    matching: bool


class Outlet(Protocol):
    """A Zenoh publisher. ``put`` may block."""

    matching_status: Matching

    def put(self, payload: bytes, *, attachment: bytes = ...) -> None: ...

    def declare_matching_listener(self, handler: object) -> Declared: ...

    def undeclare(self) -> None: ...


class _Liveliness(Protocol):
    def declare_token(self, key: str) -> Declared: ...

    def declare_subscriber(self, key: str, handler: object, *, history: bool) -> Declared: ...

    def get(self, key: str, handler: object, *, timeout: float) -> None: ...


class _Info(Protocol):
    def zid(self) -> object: ...

    def routers_zid(self) -> list[object]: ...

    def peers_zid(self) -> list[object]: ...


class Session(Protocol):
    """A Zenoh session."""

    info: _Info

    def liveliness(self) -> _Liveliness: ...

    def declare_subscriber(self, key: str, handler: object, **options: object) -> Declared: ...

    def declare_publisher(self, key: str, **options: object) -> Outlet: ...

    def declare_queryable(
        self, key: str, handler: object, *, complete: bool, **options: object
    ) -> Declared: ...

    def get(self, key: str, handler: object, **options: object) -> None: ...

    def close(self) -> None: ...


class Config(Protocol):
    """A configuration of Zenoh."""

    def get_json(self, key: str) -> str: ...

    def insert_json5(self, key: str, value: str) -> None: ...


@dataclass(frozen=True)
class NetworkOptions:
    """The endpoints to connect to and to listen on. By default, connect to a local router, and do not listen.

    ``config``: a file in Zenoh's format, for TLS, users and all other settings; ``source``: the option that names this
    file. ``scouts``: discover peers by multicast.
    """

    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    config: str = ""
    scouts: bool = False
    source: str = "--config"


def to_endpoint(text: str, *, listens: bool = False) -> str:
    """Convert text to a Zenoh endpoint; HOST or HOST:PORT means TCP. Raise EndpointError for an endpoint that can never work.

    ``listens``: the port may be 0, which selects any free port.
    """
    if not text or has_controls(text) or " " in text:
        raise EndpointError(text, f"is not an endpoint, as tcp/192.168.1.5:{DEFAULT_PORT}")
    if "/" not in text:
        has_port = re.search(r"(^[^:]*|\]):\d+$", text)
        text = f"tcp/{text}" if has_port else f"tcp/{text}:{DEFAULT_PORT}"
    protocol, _, rest = text.partition("/")
    if "://" in text or protocol not in PROTOCOLS:
        raise EndpointError(
            text,
            "is not an endpoint: give HOST, HOST:PORT or tcp/HOST:PORT (also tls, quic, udp, ws, unixsock-stream, ...)",
        )
    if protocol not in INTERNET_PROTOCOLS:
        return text
    for address in re.split(r"[?#]", rest)[0].split(","):
        host, colon, port = address.rpartition(":")
        if not colon or not port.isdecimal():
            raise EndpointError(text, f"has no port, as {protocol}/{address or 'HOST'}:{DEFAULT_PORT}")
        if len(port) > _MAX_PORT_DIGITS or not (0 if listens else 1) <= int(port) <= MAX_PORT:
            raise EndpointError(text, f"has the port {port:.20}: ports are 1 to {MAX_PORT}")
        if not _HOST.fullmatch(host):
            hint = ": an IPv6 address is in brackets, as [::1]" if ":" in host else ""
            raise EndpointError(
                text, f"has the host [{escaped(host)}], which is no name and no address{hint}"
            )
    return text


def unresolved(endpoints: Iterable[str]) -> list[str]:
    """Return the hosts in endpoints that do not resolve now.

    The hosts may resolve later, for example once mDNS runs. Blocks.
    """
    found = []
    for endpoint in endpoints:
        protocol, _, rest = endpoint.partition("/")
        host = re.split(r"[?#]", rest)[0].rpartition(":")[0].strip("[]")
        if protocol in INTERNET_PROTOCOLS and host and host != "*":
            try:
                socket.getaddrinfo(host, None)
            except (OSError, UnicodeError):
                found.append(host)
    return found


def is_loopback_endpoint(endpoint: str) -> bool:
    """Return whether an endpoint is on this machine."""
    address = endpoint.partition("/")[2].partition("#")[0].partition("?")[0].rpartition(":")[0].strip("[]")
    if address == "localhost":
        return True
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False


def require_zenoh(who: str = "the fleet", *, has_many_links: bool = False, needs_hash: bool = False) -> None:
    """Raise BridgeError, with instructions, if the Zenoh library is missing or its protocol version differs.

    ``who``: the feature that needs Zenoh, named in the message. ``has_many_links``: many peers will connect.
    ``needs_hash``: the feature also needs the library xxhash.
    """
    if has_many_links:
        # Set this before the import, because Zenoh reads it only once.
        os.environ.setdefault("ZENOH_RUNTIME", _THREADS)
    line = install_command("minirospy[fleet]", upgrade=True)
    libraries = {"eclipse-zenoh": "zenoh.ext"} | ({"xxhash": "xxhash"} if needs_hash else {})
    for library, module in libraries.items():
        try:
            importlib.import_module(module)
        except ImportError as error:
            raise BridgeError(f"{who} needs the library {library}: {line}") from error
    version = importlib.metadata.version("eclipse-zenoh")
    parts = [int(each) for each in re.findall(r"\d+", version)]
    if parts[0] != 1 or parts < [1, 5]:
        raise BridgeError(f"{who} needs eclipse-zenoh of version 1.5 or newer below 2, not {version}: {line}")


def configured(options: NetworkOptions) -> Config:
    """Return Zenoh's configuration, built from the file and the options.

    The session listens only if the file or an option requests that.
    """
    zenoh = importlib.import_module("zenoh")
    default: Config = zenoh.Config()
    config: Config = default
    if options.config:
        if not Path(options.config).is_file():
            raise BridgeError(f"{options.source} {options.config}: there is no such file")
        try:
            config = zenoh.Config.from_file(options.config)
        except zenoh.ZError as error:
            raise BridgeError(f"{options.source} {options.config}: {one_line(error)}") from error
    untouched: Config = zenoh.Config()

    def is_set(key: str) -> bool:
        return bool(options.config) and config.get_json(key) != untouched.get_json(key)

    def put(key: str, value: object) -> None:
        try:
            config.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            raise BridgeError(f"{key} may not be {value}: {one_line(error)}") from error

    listens = bool(options.listen) or is_set("listen/endpoints")
    connects = bool(options.connect) or is_set("connect/endpoints")
    if options.listen:
        put("listen/endpoints", list(options.listen))
    elif not listens:
        put("listen/endpoints", [])
    if options.connect:
        put("connect/endpoints", list(options.connect))
    elif not (connects or listens or options.scouts):
        put("connect/endpoints", [DEFAULT_ENDPOINT])
    if not is_set("mode"):
        # A router forwards between all peers connected to it; a client has a single connection.
        put("mode", "router" if listens else "peer" if options.scouts else "client")
    mode = json.loads(config.get_json("mode"))
    put("scouting/multicast/enabled", options.scouts)
    # A gateway reconnects to its router forever. A client without a router fails to open, and its caller tries again.
    for key, value in (
        ("connect/timeout_ms", CONNECT_MS if mode == "client" else -1),
        ("connect/exit_on_failure", mode == "client"),
        ("connect/retry", {"period_init_ms": 500, "period_max_ms": 4000, "period_increase_factor": 2}),
        ("transport/unicast/max_sessions", _SESSIONS),
        ("transport/unicast/accept_pending", 1000),
        # Keep-alive messages per lease of 10 s, one fewer than Zenoh's default, because TCP retransmits lost data.
        ("transport/link/tx/keep_alive", 3),
        # A small send buffer delays high-priority data less: about 0.3 s at 4 Mbit/s instead of 1.3 s.
        ("transport/link/tcp/so_sndbuf", _SEND_BUFFER),
        # Do not send large messages to local gateways through /dev/shm, which is small in containers.
        ("transport/shared_memory/enabled", False),
    ):
        if not is_set(key):
            put(key, value)
    return config


def one_line(error: Exception) -> str:
    # Omit the location in Zenoh's source code, which does not help the user.
    return escaped(re.sub(r" at /\S*\.rs:\d+\.?", "", " ".join(str(error).split())))[:500]
