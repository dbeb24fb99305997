"""Functions for sockets that need no loop: setting options, polling, and closing."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import struct
import sys
import time
from typing import NamedTuple

__all__ = [
    "BUSY_POLL_SECONDS",
    "FAMILIES",
    "HANDSHAKE_SECONDS",
    "busy_poll",
    "busy_receive",
    "enlarge_send_buffer",
    "hang_up",
    "is_readable",
    "is_writable",
    "may_busy_poll",
    "peer",
    "resolvable",
    "tune",
]

FAMILIES = (socket.AF_INET, socket.AF_INET6)  # the address families of TCP sockets

HANDSHAKE_SECONDS = 10.0  # time limit in seconds per handshake, because a peer may never respond

BUSY_POLL_SECONDS = 0.0002  # seconds within which most responses from a process on the same host arrive

KEEPALIVE = {"TCP_KEEPIDLE": 20, "TCP_KEEPALIVE": 20, "TCP_KEEPINTVL": 10, "TCP_KEEPCNT": 3}
"""Seconds of silence before probing (on macOS called TCP_KEEPALIVE), seconds between probes, number of probes."""

# Buffer size to request for a Unix socket, in bytes; TCP sockets buffer as much.
# Linux limits it to net.core.wmem_max (208 kB by default).
_SEND_BUFFER = 4 * 1024 * 1024

_PEER = struct.Struct("iII")  # layout of the kernel's credentials for a peer, see Peer


class Peer(NamedTuple):
    """Process id, user id and group id of the process at the other end of a socket."""

    process: int
    user: int
    group: int


def tune(sock: socket.socket, *, nodelay: bool = True) -> None:
    """Set TCP_NODELAY as requested, and keepalive, so that a peer that lost power is detected within a minute.

    Has no effect on sockets that are not TCP sockets.
    """
    if sock.family not in FAMILIES:
        return
    if nodelay:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in KEEPALIVE.items():
        if hasattr(socket, option):
            with contextlib.suppress(OSError):
                sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)


def enlarge_send_buffer(sock: socket.socket) -> None:
    """Enlarge a Unix socket's send buffer to several megabytes, or as far as the kernel allows. TCP enlarges its own buffers.

    Otherwise the receiver of a 1 MB message must run several times, and a busy machine may run another process in between.
    """
    if sock.family not in FAMILIES:
        with contextlib.suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)


def resolvable(host: str) -> bytes:
    """Encode a host name for a resolver. Raise OSError if it is not a host name.

    A str would make the resolver import the IDNA codec, which takes a tenth of a command's run time.
    """
    try:
        return host.encode("ascii" if host.isascii() else "idna")
    except UnicodeError as error:
        raise OSError(f"'{host}' is not a name of a machine") from error


def peer(sock: socket.socket) -> Peer:
    """Return the credentials of the process at the other end of a Unix socket. Linux only."""
    return Peer(*_PEER.unpack(sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _PEER.size)))


def hang_up(sock: socket.socket) -> None:
    """Shut a connection down. A thread that is blocked reading from it wakes up and closes it."""
    with contextlib.suppress(OSError):
        sock.shutdown(socket.SHUT_RDWR)


def is_readable(sock: socket.socket) -> bool:
    """Return whether a read would not block. Uses poll, because select fails on descriptors above 1023."""
    if hasattr(select, "poll"):
        return bool(_poll(sock, select.POLLIN).poll(0))
    return bool(select.select([sock], [], [], 0)[0])


def is_writable(sock: socket.socket, milliseconds: int) -> bool:
    """Return whether the socket becomes writable within the timeout. Busy-polls first, like busy_poll()."""
    if hasattr(select, "poll"):
        return (may_busy_poll(sock) and _busy_poll(sock, select.POLLOUT)) or bool(
            _poll(sock, select.POLLOUT).poll(milliseconds)
        )
    return bool(select.select([], [sock], [], milliseconds / 1000)[1])


def busy_poll(sock: socket.socket) -> None:
    """Busy-poll for another process's response, for up to 0.2 ms.

    Waking up takes as long as such a response. While polling, this yields the processor to other processes, because the
    peer may need it. Has no effect on a socket that may not be busy-polled.
    """
    if may_busy_poll(sock):
        _busy_poll(sock, select.POLLIN)


def may_busy_poll(sock: socket.socket) -> bool:
    """Return whether the peer is another process on this machine, connected by a Unix socket.

    A peer in this process needs the GIL, which busy-polling would occupy.
    """
    return sys.platform == "linux" and sock.family == socket.AF_UNIX and peer(sock).process != os.getpid()


def busy_receive(sock: socket.socket, space: memoryview) -> int:
    """Receive data that another process sends within 0.2 ms, by busy-polling.

    Use it only if ``may_busy_poll`` is true. Raise BlockingIOError if nothing arrives, OSError if the connection fails.
    """
    end = time.perf_counter() + BUSY_POLL_SECONDS
    while True:
        os.sched_yield()
        try:
            return sock.recv_into(space, 0, socket.MSG_DONTWAIT)
        except BlockingIOError:
            if time.perf_counter() > end:
                raise


def _busy_poll(sock: socket.socket, events: int) -> bool:
    """Poll for ``events`` for up to 0.2 ms; return whether they occurred."""
    poll = _poll(sock, events)
    end = time.perf_counter() + BUSY_POLL_SECONDS
    while True:
        # Yield first, because the peer may need this processor.
        os.sched_yield()
        if poll.poll(0):
            return True
        if time.perf_counter() > end:
            return False


def _poll(sock: socket.socket, events: int) -> select.poll:
    poll = select.poll()
    poll.register(sock, events)
    return poll
