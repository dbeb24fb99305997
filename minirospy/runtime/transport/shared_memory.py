"""Finds out whether two processes can share memory for large messages, and the reason if they cannot. Linux only.

Both processes must have the same user.

The publisher's end of such a connection is in :mod:`minirospy.runtime.transport.ring_sender`, the subscriber's in
:mod:`minirospy.runtime.transport.ring_receiver`. Source: docs/shared_memory.md.
"""

from __future__ import annotations

import os
import socket
import sys

from minirospy.runtime.transport.sockets import peer

__all__ = ["ascii_text", "is_possible", "may_share", "obstacle", "why_impossible"]


def is_possible() -> bool:
    """Return whether this system supports everything that a ring needs."""
    return sys.platform == "linux" and hasattr(os, "memfd_create") and hasattr(os, "eventfd")


def may_share(sock: socket.socket) -> bool:
    """Return whether the peer of ``sock`` is a process on this machine, and belongs to the same user.

    Another user's process could shrink a ring while this process reads it, or read a topic's memory after disconnecting.
    """
    return is_possible() and sock.family == socket.AF_UNIX and peer(sock).user == os.geteuid()


def obstacle(sock: socket.socket, *, is_same_host: bool) -> str:
    """Return the reason why a publisher's connection has no :class:`RingSender`."""
    if sock.family != getattr(socket, "AF_UNIX", None):
        if not is_same_host:
            return "the subscriber is on another machine or in another container"
        return "the subscriber is not a minirospy node, or cannot use Unix sockets (MINIROSPY_TRANSPORT=tcp)"
    if not is_possible():
        return why_impossible()
    if peer(sock).user != os.geteuid():
        return "the subscriber belongs to another user"
    return "the subscriber does not use it (MINIROSPY_TRANSPORT=unix, a bridge or a dashboard)"


def why_impossible() -> str:
    """Return the reason why :func:`is_possible` is false."""
    if sys.platform != "linux":
        return "it needs Linux"
    return "this Python has no os.memfd_create or os.eventfd"


def ascii_text(error: Exception) -> str:
    """Return an error's text in ASCII, because other processes parse it; the system's messages may be translated."""
    text = getattr(error, "strerror", None) or str(error)
    return text.encode("ascii", "replace").decode()
