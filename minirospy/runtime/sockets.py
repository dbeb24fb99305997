"""Sockets, without a loop: what is set on them, and how they are looked at and ended."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import sys
import time

__all__ = [
    "EXPECTED_SECONDS",
    "FAMILIES",
    "HANDSHAKE_SECONDS",
    "expect_answer",
    "hang_up",
    "is_readable",
    "resolvable",
    "tune",
]

FAMILIES = (socket.AF_INET, socket.AF_INET6)
"""What a socket of TCP is of."""

HANDSHAKE_SECONDS = 10.0
"""Others may never answer: each handshake ends after this."""

EXPECTED_SECONDS = 0.0002
"""Within this most answers come from a process of this machine."""

_KEEPALIVE = {"TCP_KEEPIDLE": 20, "TCP_KEEPALIVE": 20, "TCP_KEEPINTVL": 10, "TCP_KEEPCNT": 3}
"""Seconds of silence, seconds between questions, questions. macOS calls the first TCP_KEEPALIVE."""


def tune(sock: socket.socket, *, nodelay: bool = True) -> None:
    """TCP_NODELAY as asked; keepalive, so that a peer that lost power is noticed within a minute.

    A socket of another kind is left as it is.
    """
    if sock.family not in FAMILIES:
        return
    if nodelay:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in _KEEPALIVE.items():
        if hasattr(socket, option):
            with contextlib.suppress(OSError):
                sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)


def resolvable(host: str) -> bytes:
    """A host's name as a resolver takes it. Raises OSError where it can be nobody's.

    A str would have the resolver import the IDNA codec, which takes a command a tenth of its time.
    """
    try:
        return host.encode("ascii" if host.isascii() else "idna")
    except UnicodeError as error:
        raise OSError(f"'{host}' is no name of a machine") from error


def hang_up(sock: socket.socket) -> None:
    """End a connection; a thread that is blocked in a read of it wakes up and closes it."""
    with contextlib.suppress(OSError):
        sock.shutdown(socket.SHUT_RDWR)


def is_readable(sock: socket.socket) -> bool:
    """Whether a read would not wait. poll, since select fails on descriptors above 1023."""
    if hasattr(select, "poll"):
        return bool(_poll(sock, select.POLLIN).poll(0))
    return bool(select.select([sock], [], [], 0)[0])


def is_writable(sock: socket.socket, milliseconds: int) -> bool:
    """Whether the socket takes something within so long; for most of the time a look, see expect_answer."""
    if hasattr(select, "poll"):
        return _expect(sock, select.POLLOUT) or bool(_poll(sock, select.POLLOUT).poll(milliseconds))
    return bool(select.select([], [sock], [], milliseconds / 1000)[1])


def expect_answer(sock: socket.socket) -> None:
    """Wait for what a process of this machine answers, a fifth of a millisecond at most, without falling asleep.

    To be woken takes as long as such a call. The processor is offered to others meanwhile: the peer may need it. A
    socket of TCP is left as it is.
    """
    if hasattr(select, "poll"):
        _expect(sock, select.POLLIN)


def _expect(sock: socket.socket, events: int) -> bool:
    """Look for the events for a fifth of a millisecond; False where they do not come, or it is a socket of TCP."""
    if sys.platform != "linux" or sock.family in FAMILIES:
        return False
    poll = _poll(sock, events)
    end = time.perf_counter() + EXPECTED_SECONDS
    while not poll.poll(0):
        if time.perf_counter() > end:
            return False
        os.sched_yield()
    return True


def _poll(sock: socket.socket, events: int) -> select.poll:
    poll = select.poll()
    poll.register(sock, events)
    return poll
