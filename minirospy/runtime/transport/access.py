"""Access control: the networks set by ``--allow`` and MINIROSPY_ALLOW."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING

from minirospy.base.errors import UsageError

if TYPE_CHECKING:
    # Imported for type checking. At run time it is imported only if networks are given, which is rare.
    from ipaddress import IPv4Network, IPv6Network

__all__ = ["Access", "listening_lines", "own_addresses"]

_SIOCGIFCONF = 0x8912  # the ioctl that lists IPv4 addresses, see netdevice(7)
_MAX_ADDRESSES = 1024  # maximum IPv4 addresses to read; a host with many containers has several hundred


class Access:
    """Allows this machine and the peers in the given networks. If no network is given, allows all peers."""

    def __init__(self, networks: Iterable[str] = ()) -> None:
        """Allow ``networks``, such as 192.168.65.0/24 or a single address. Raise UsageError if one is invalid."""
        self.networks = tuple(_network(text) for text in networks)
        # Cached decisions, keyed by address: a robot has few peers, and they connect often.
        self._known: dict[str, bool] = {}

    @classmethod
    def parse(cls, text: str) -> Access:
        """Parse networks separated by commas or spaces; "" allows all peers. Raise UsageError if one is invalid."""
        networks = text.replace(",", " ").split()
        if text and not networks:
            # The text may come from unset variables: a list that turns out empty must not allow all peers.
            raise UsageError(f"'{text}' names no network: write as 192.168.65.0/24, or an address")
        return cls(networks)

    def allows(self, peer: str, here: str = "") -> bool:
        """Return whether a connection from the address ``peer`` is allowed; ``here`` is the local address."""
        if not self.networks:
            return True
        known = self._known.get(peer)
        if known is None:
            if len(self._known) > 1000:
                self._known.clear()
            known = self._known[peer] = self._decide(peer)
        return known or peer == here

    def _decide(self, peer: str) -> bool:
        import ipaddress

        try:
            address = ipaddress.ip_address(peer.partition("%")[0])
        except ValueError:
            return False
        mapped = getattr(address, "ipv4_mapped", None)
        address = mapped or address
        return address.is_loopback or any(address in network for network in self.networks)

    def __str__(self) -> str:
        return ", ".join(map(str, self.networks)) or "everybody"


def listening_lines(bind_host: str, port: int, access: Access, *, local: bool = False) -> list[str]:
    """Return lines that list a server's addresses, and a warning if it is reachable from the open internet."""
    import ipaddress

    if local:
        who = "open to this machine alone; nodes stay on it with `export MINIROSPY_LOCAL=1`"
    elif access.networks:
        who = f"open to {access}"
    elif bind_host.startswith("127.") or bind_host == "::1":
        who = "open to this machine alone"
    else:
        who = "open to everybody; `roscore --local` opens it to this machine alone"
    lines = [f"listening on {_address(bind_host)}:{port}, {who}"]
    if bind_host not in {"0.0.0.0", "::"} or access.networks:
        own = [bind_host] if not access.networks else []
    else:
        own = own_addresses()
    public = [text for text in own if ipaddress.ip_address(text.partition("%")[0]).is_global]
    if public:
        lines.append(
            f"WARNING: the open internet reaches this master at {', '.join(public)}, and ROS has no passwords: "
            "say who may connect with --allow (as --allow 192.168.65.0/24), or listen elsewhere with ROS_IP"
        )
    return lines


def own_addresses() -> list[str]:
    """Return the IP addresses of this machine's interfaces."""
    import socket

    if sys.platform == "linux":
        # Importing psutil would delay the master's first answer, and take 3 MB.
        with contextlib.suppress(OSError):
            return [*_linux_ipv4_addresses(), *_linux_ipv6_addresses()]
    import psutil

    families = {socket.AF_INET, socket.AF_INET6}
    return [
        each.address for all_ in psutil.net_if_addrs().values() for each in all_ if each.family in families
    ]


def _linux_ipv4_addresses() -> list[str]:
    """Return the IPv4 addresses of all interfaces: see SIOCGIFCONF in netdevice(7). Raise OSError if that fails."""
    import array
    import fcntl
    import socket
    import struct

    # A struct ifreq is an interface's name and a union. One member is a struct sockaddr_in; the largest is a struct ifmap.
    record_size = 16 + (24 if struct.calcsize("P") == 8 else 16)
    address_at = 16 + 4
    records = array.array("B", bytes(record_size * _MAX_ADDRESSES))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        request = struct.pack("iP", len(records), records.buffer_info()[0])
        used, _ = struct.unpack("iP", fcntl.ioctl(sock, _SIOCGIFCONF, request))
    if used == len(records):
        raise OSError("there may be more addresses than were read")
    return [
        socket.inet_ntoa(records[start + address_at : start + address_at + 4].tobytes())
        for start in range(0, used, record_size)
    ]


def _linux_ipv6_addresses() -> list[str]:
    """Return the IPv6 addresses of all interfaces, or [] if IPv6 is turned off. Raise OSError if they cannot be read."""
    import socket

    try:
        with open("/proc/net/if_inet6", encoding="ascii") as file:
            return [socket.inet_ntop(socket.AF_INET6, bytes.fromhex(line.split()[0])) for line in file]
    except FileNotFoundError:
        if not os.path.exists("/proc/net"):
            raise
        return []


def _address(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _network(text: str) -> IPv4Network | IPv6Network:
    import ipaddress

    try:
        return ipaddress.ip_network(text, strict=False)
    except ValueError as error:
        raise UsageError(f"'{text}' is not a network, as 192.168.65.0/24, nor an address") from error
