"""Check whether a host and port can be reached, and name the fault if not.

Every function blocks the calling thread for a bounded time; :func:`in_parallel` makes many calls at the same time.
"""

from __future__ import annotations

import contextlib
import errno
import queue
import socket
import threading
import time
from collections.abc import Callable, Iterable
from enum import Enum
from typing import NamedTuple, TypeVar
from urllib.parse import urlsplit

from minirospy.base.errors import (
    MasterUnreachableError,
    MinirospyError,
    RpcProtocolError,
    RpcTimeout,
    RpcUnreachable,
    WireError,
)
from minirospy.core.wire.framing import LENGTH_BYTES, parse_length
from minirospy.core.wire.header import MAX_HEADER, Header, parse_header, serialize_header
from minirospy.core.wire.tcpros import ANY, InterfaceType, check_publisher, subscriber_header
from minirospy.runtime.rpc.master_proxy import SlaveProxy

__all__ = [
    "CONNECT_SECONDS",
    "RESUME",
    "Fault",
    "MasterLocation",
    "Trouble",
    "addresses",
    "addresses_of",
    "host_port",
    "in_parallel",
    "is_loopback",
    "is_own_address",
    "look_up",
    "own_address_towards",
    "read_topic",
    "trouble_of",
]

CONNECT_SECONDS = 1.5
"""Connect timeout in seconds. A reachable peer responds within this time, even over a poor radio link."""

RESUME = "it is busy, or suspended: after Ctrl-Z, `fg` in its terminal continues it"
"""Advice for :attr:`Fault.LATE`."""

LOOK_UP_SECONDS = 2.0  # seconds to wait for a name server's response

_MAX_THREADS = 32
_MAX_BYTES = 1024 * 1024
_A = TypeVar("_A")
_R = TypeVar("_R")


class Fault(str, Enum):
    """Reasons why an address does not respond, as far as this machine can tell."""

    NAME = "name"  # the host name does not resolve
    REFUSED = "refused"  # the machine runs, but no process listens on the port
    SILENT = "silent"
    """No response: the machine is off, another machine has its address, or a firewall drops the packets."""
    LATE = "late"  # connected, but no response: the process is busy or suspended
    NO_ROUTE = "no route"  # no network, or a firewall rejects the packets
    STRANGER = "stranger"  # the peer responds, but not with a ROS protocol
    OTHER = "other"


class Trouble(NamedTuple):
    """The reason why a peer does not respond, and its description."""

    fault: Fault
    text: str


class MasterLocation(NamedTuple):
    """The master's host and port in ROS_MASTER_URI, and the host's addresses ([] if it does not resolve)."""

    host: str
    port: int
    addresses: list[str]

    @property
    def is_local(self) -> bool:
        """Return whether the master is on this machine."""
        return is_loopback(self.host) or any(map(is_own_address, self.addresses))

    @property
    def own_address(self) -> str:
        """Return the address at which the master's machine sees this one, or "" if there is no route."""
        return own_address_towards(self.addresses[0]) if self.addresses else ""


def trouble_of(error: Exception) -> Trouble:
    """Classify an error raised by a call, a connection or a name lookup."""
    text = str(error)
    if isinstance(error, MasterUnreachableError) and isinstance(error.__cause__, RpcUnreachable):
        error = error.__cause__

    if isinstance(error, RpcTimeout):
        return Trouble(Fault.LATE, error.why)
    if isinstance(error, RpcUnreachable):
        text = error.why
        if isinstance(error.__cause__, Exception):
            error = error.__cause__

    if isinstance(error, socket.gaierror):
        return Trouble(Fault.NAME, "the name is not known")
    if isinstance(error, TimeoutError):
        return Trouble(Fault.SILENT, "no answer")
    if isinstance(error, ConnectionRefusedError):
        return Trouble(Fault.REFUSED, "connection refused")

    if isinstance(error, OSError) and error.errno in (
        errno.EHOSTUNREACH,
        errno.ENETUNREACH,
        errno.EACCES,
        errno.EPERM,
        errno.EHOSTDOWN if hasattr(errno, "EHOSTDOWN") else errno.EHOSTUNREACH,
    ):
        return Trouble(Fault.NO_ROUTE, error.strerror or str(error))

    if isinstance(error, EOFError | RpcProtocolError | WireError | ConnectionError):
        return Trouble(Fault.STRANGER, text)
    return Trouble(Fault.OTHER, text)


def addresses(host: str, timeout: float = LOOK_UP_SECONDS) -> list[str]:
    """Return the addresses of a host name, IPv4 first, or [] if it does not resolve in time."""
    try:
        return look_up(host, timeout)
    except OSError:
        return []


def addresses_of(hosts: Iterable[str], timeout: float = LOOK_UP_SECONDS) -> dict[str, list[str]]:
    """Look up several host names in parallel; return a dict from name to addresses, like :func:`addresses`."""
    names = list(dict.fromkeys(hosts))
    found = in_parallel(_ask_resolver, names, timeout)
    return {
        name: [] if isinstance(each, Exception) else each for name, each in zip(names, found, strict=True)
    }


def look_up(host: str, timeout: float = LOOK_UP_SECONDS) -> list[str]:
    """Return a host's addresses like :func:`addresses`, but raise OSError on failure.

    The function exists because the system's own timeout is half a minute.
    """
    (found,) = in_parallel(_ask_resolver, [host], timeout)
    if isinstance(found, Exception):
        raise socket.gaierror(socket.EAI_NONAME, f"the name '{host}' is not known") from found
    return found


def _ask_resolver(name: str) -> list[str]:
    found = socket.getaddrinfo(name, None, type=socket.SOCK_STREAM)
    ordered = sorted(found, key=lambda info: info[0] != socket.AF_INET)
    return list(dict.fromkeys(str(info[4][0]) for info in ordered))


def is_loopback(host: str) -> bool:
    """Return whether a name or address is a loopback address."""
    return host in {"localhost", "ip6-localhost", "::1"} or host.startswith("127.")


def is_own_address(address: str) -> bool:
    """Return whether an address belongs to this machine: a socket can be bound to it."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.bind((address, 0))
    except OSError:
        return False
    return True


def own_address_towards(address: str) -> str:
    """Return this machine's address on the route to ``address``, or "" if there is no route. Sends no packets."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((address, 9))
            return str(probe.getsockname()[0])
    except OSError:
        return ""


def host_port(uri: str) -> tuple[str, int]:
    """Return (host, port) of ``http://host:port/`` or ``rosrpc://host:port``, and ("", 0) for any other string."""
    try:
        parts = urlsplit(uri)
        return parts.hostname or "", parts.port or 0
    except ValueError:
        return "", 0


def read_topic(
    uri: str, topic: str, caller_id: str, timeout: float = CONNECT_SECONDS, *, wait: bool = False
) -> tuple[Header, bytes]:
    """Return the connection header of the publisher with Slave API ``uri`` and, with ``wait``, its first message.

    Each step may take ``timeout`` seconds. Raise RpcError if the call fails, WireError if its data is invalid, or
    OSError if the connection fails.
    """
    look_up(host_port(uri)[0])
    with contextlib.closing(SlaveProxy(uri, caller_id, timeout, same_host=False)) as slave:
        answer = slave.request_topic(topic, [["TCPROS"]])

    match answer:
        case ["TCPROS", str(host), int(port), *_]:
            look_up(host)
        case _:
            raise WireError(f"{uri} answered requestTopic for {topic} with {answer!r}")

    with socket.create_connection((host, port), timeout) as sock:
        fields = subscriber_header(topic, InterfaceType(ANY, ANY), caller_id)
        sock.sendall(serialize_header(fields))
        header = parse_header(_receive(sock, MAX_HEADER))
        check_publisher(header, topic, InterfaceType(ANY, ANY))
        return header, _receive(sock, _MAX_BYTES) if wait else b""


def _receive(sock: socket.socket, most: int) -> bytes:
    """Receive a length-prefixed block. Raise WireError if it is longer than ``most``, OSError if the connection fails."""

    def exactly(count: int) -> bytes:
        data = b""
        while len(data) < count:
            more = sock.recv(count - len(data))
            if not more:
                raise WireError("the connection was closed in the middle")
            data += more
        return data

    length = parse_length(exactly(LENGTH_BYTES))
    if length > most:
        raise WireError(f"{length} bytes are announced: that is not TCPROS")
    return exactly(length)


def in_parallel(
    function: Callable[[_A], _R], arguments: Iterable[_A], timeout: float
) -> list[_R | Exception]:
    """Call ``function`` for all arguments in parallel; return each call's result or exception.

    For a call that takes too long, the exception is TimeoutError. Runs in daemon threads: a name lookup cannot be
    cancelled, and must not prevent the program from exiting.
    """
    waiting = list(enumerate(arguments))
    results: list[_R | Exception] = [TimeoutError("timed out")] * len(waiting)
    work: queue.SimpleQueue[tuple[int, _A]] = queue.SimpleQueue()
    done: queue.SimpleQueue[tuple[int, _R | Exception]] = queue.SimpleQueue()
    for entry in waiting:
        work.put(entry)

    def run() -> None:
        while True:
            try:
                number, argument = work.get_nowait()
            except queue.Empty:
                return
            try:
                done.put((number, function(argument)))
            except (MinirospyError, OSError, EOFError, TypeError, ValueError) as error:
                done.put((number, error))

    for _ in range(min(len(waiting), _MAX_THREADS)):
        threading.Thread(target=run, name="minirospy-doctor", daemon=True).start()
    end = time.monotonic() + timeout
    for _ in waiting:
        try:
            number, result = done.get(timeout=max(0.0, end - time.monotonic()))
        except queue.Empty:
            break
        results[number] = result
    return results
