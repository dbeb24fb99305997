"""The user at the other end of a TCP connection on this machine. Linux only: elsewhere nobody knows.

A look-up asks the kernel for one socket (sock_diag, 23 us); where that is not allowed, its table of all sockets is read.
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
"""The state of a listening socket, which the kernel returns where no connection fits."""
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
    """Return whether the peer of a connection is known to be a process of this user; ``here`` is this end."""
    return sys.platform == "linux" and owner_of(peer, here) == os.getuid()


def owner_of(end: tuple[str, int], other_end: tuple[str, int]) -> int | None:
    """Return the user of the TCP socket of this machine at ``end`` that is connected to ``other_end``, in any state.

    Return None if there is no such socket, or if no process has it open any more: the kernel lists those as root's.
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
        # No such sockets here, or they are forbidden.
        return _by_table(*ends)


def _by_query(end: _End, other_end: _End) -> int | None:
    """Return the user by a query for one socket. Raise OSError. Source: sock_diag(7)."""
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
        # An error: the same of no such socket and of what the kernel does not offer.
        return _by_table(end, other_end)
    if len(answer) < _ANSWER_SIZE or answer[_MESSAGE.size + 1] == _LISTEN:
        return None
    user, inode = _USER_AND_INODE.unpack_from(answer, _USER_AT)
    return int(user) if inode else None


def _by_table(end: _End, other_end: _End) -> int | None:
    """Return the user by the table of all sockets. Source: proc_net_tcp of the kernel's documentation."""
    port = f":{end[1]:04X} "
    for table in _TABLES:
        try:
            lines = table.read_text(encoding="ascii").splitlines()[1:]
        except (OSError, ValueError):
            continue
        for line in lines:
            if port not in line:
                continue  # most of thousands, without parsing
            _, local, remote, _, _, _, _, user, _, inode, *_ = line.split()
            if (_listed(local), _listed(remote)) == (end, other_end) and inode != "0":
                return int(user)
    return None


def _parsed(end: tuple[str, int]) -> _End:
    """Return an address as the socket API has it, and its port. Raise ValueError."""
    return _unmapped(ipaddress.ip_address(end[0].partition("%")[0])), end[1]


def _listed(text: str) -> _End:
    """Return an address and a port of the kernel's table: words of 32 bits in the byte order of the machine."""
    host, _, port = text.partition(":")
    words = [int(host[at : at + 8], 16).to_bytes(4, sys.byteorder) for at in range(0, len(host), 8)]
    return _unmapped(ipaddress.ip_address(b"".join(words))), int(port, 16)


def _unmapped(address: _Address) -> _Address:
    """Return the IPv4 address in an IPv6 address that has one: a socket of IPv6 may be connected by IPv4."""
    return (address.ipv4_mapped or address) if isinstance(address, ipaddress.IPv6Address) else address
