"""Find the user at the other end of a TCP connection on this machine. Linux only; on other systems the user is unknown.

A look-up queries the kernel for one socket (sock_diag, 23 us). If that is not allowed, it reads the kernel's table of all
sockets.
"""

from __future__ import annotations

import ipaddress
import os
import socket
import struct
import sys
from pathlib import Path

__all__ = ["is_own_user", "owner_of"]

_TABLES = (Path("/proc/net/tcp"), Path("/proc/net/tcp6"))

_NETLINK_SOCK_DIAG = 4
_SOCK_DIAG_BY_FAMILY = 20
_NLM_F_REQUEST = 1
_ANY = 0xFFFFFFFF
_LISTEN = 10
"""State of a listening socket: if no connection matches, the kernel returns a listening socket instead."""
_MESSAGE = struct.Struct("=IHHII")
_REQUEST = struct.Struct("=BBBBI")
_PORTS = struct.Struct("!HH")
_REST_OF_ID = struct.Struct("=III")
_USER_AND_INODE = struct.Struct("=II")
_USER_AT = _MESSAGE.size + 4 + 48 + 12
_ANSWER_SIZE = _USER_AT + _USER_AND_INODE.size

_Address = ipaddress.IPv4Address | ipaddress.IPv6Address
_End = tuple[_Address, int]


def is_own_user(peer: tuple[str, int], here: tuple[str, int]) -> bool:
    """Return whether a connection's peer is known to be a process of this user. ``here`` is the connection's local end."""
    return sys.platform == "linux" and owner_of(peer, here) == os.getuid()


def owner_of(end: tuple[str, int], other_end: tuple[str, int]) -> int | None:
    """Return the user that owns the local TCP socket from ``end`` to ``other_end``, whatever its state.

    Return None if there is no such socket, or if no process has it open any more, because the kernel lists it as root's.
    """
    try:
        ends = _parsed(end), _parsed(other_end)
    except ValueError:
        return None
    if ends[0][0].version != ends[1][0].version:
        return None
    try:
        return _by_query(*ends)
    except (OSError, AttributeError, struct.error):
        # The system does not support or permit sock_diag.
        return _by_table(*ends)


def _by_query(end: _End, other_end: _End) -> int | None:
    """Query the kernel for a socket; return the user that owns it. Source: sock_diag(7).

    Raise OSError if the query fails.
    """
    family = socket.AF_INET if end[0].version == 4 else socket.AF_INET6
    addresses = b"".join(each[0].packed.ljust(16, b"\0") for each in (end, other_end))
    id_ = _PORTS.pack(end[1], other_end[1]) + addresses + _REST_OF_ID.pack(0, _ANY, _ANY)
    body = _REQUEST.pack(family, socket.IPPROTO_TCP, 0, 0, _ANY) + id_
    size = _MESSAGE.size + len(body)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_DGRAM, _NETLINK_SOCK_DIAG) as asking:  # type: ignore[attr-defined, unused-ignore]
        asking.settimeout(1.0)
        asking.send(_MESSAGE.pack(size, _SOCK_DIAG_BY_FAMILY, _NLM_F_REQUEST, 0, 0) + body)
        answer = asking.recv(4096)
    kind = _MESSAGE.unpack_from(answer)[1]
    if kind != _SOCK_DIAG_BY_FAMILY:
        # The kernel returns the same error for a missing socket and for an unsupported query.
        return _by_table(end, other_end)
    if len(answer) < _ANSWER_SIZE or answer[_MESSAGE.size + 1] == _LISTEN:
        return None
    user, inode = _USER_AND_INODE.unpack_from(answer, _USER_AT)
    return int(user) if inode else None


def _by_table(end: _End, other_end: _End) -> int | None:
    """Find a socket in the kernel's table; return the user. Source: proc_net_tcp in the kernel's documentation."""
    port = f":{end[1]:04X} "
    for table in _TABLES:
        try:
            lines = table.read_text(encoding="ascii").splitlines()[1:]
        except (OSError, ValueError):
            continue
        for line in lines:
            if port not in line:
                continue  # do not parse irrelevant lines, because there may be thousands
            _, local, remote, _, _, _, _, user, _, inode, *_ = line.split()
            if (_listed(local), _listed(remote)) == (end, other_end) and inode != "0":
                return int(user)
    return None


def _parsed(end: tuple[str, int]) -> _End:
    """Parse an (address, port) from the socket API. Raise ValueError if the address is invalid."""
    return _unmapped(ipaddress.ip_address(end[0].partition("%")[0])), end[1]


def _listed(text: str) -> _End:
    """Parse an address and port in the kernel's table, which has 32-bit words in native byte order."""
    host, _, port = text.partition(":")
    words = [int(host[at : at + 8], 16).to_bytes(4, sys.byteorder) for at in range(0, len(host), 8)]
    return _unmapped(ipaddress.ip_address(b"".join(words))), int(port, 16)


def _unmapped(address: _Address) -> _Address:
    """Return the IPv4 address in an IPv4-mapped IPv6 address, which an IPv6 socket reports for an IPv4 peer."""
    return (address.ipv4_mapped or address) if isinstance(address, ipaddress.IPv6Address) else address
