"""The bridge's addresses for users: this machine's addresses, links to front ends, and a QR code for the terminal."""

from __future__ import annotations

import contextlib
import io
import socket
from typing import NamedTuple
from urllib.parse import quote

__all__ = ["Links", "host_names", "links", "own_addresses", "qr_code"]

FOXGLOVE_APP = "https://app.foxglove.dev/~/view"
LICHTBLICK_APP = "https://lichtblick-suite.github.io/lichtblick/"


class Links(NamedTuple):
    """A listener's URLs. The links to the front ends are for a browser on this machine, and contain no token."""

    websocket: list[str]
    foxglove: str
    lichtblick: str


def links(addresses: list[str], port: int, *, encrypted: bool) -> Links:
    """Return the URLs of a listener at these addresses; the front ends' links use the first address."""
    scheme = "wss" if encrypted else "ws"
    websocket = [f"{scheme}://{_in_uri(address)}:{port}" for address in addresses]
    query = f"ds=foxglove-websocket&ds.url={quote(websocket[0], safe='')}"
    return Links(websocket, f"{FOXGLOVE_APP}?{query}", f"{LICHTBLICK_APP}?{query}")


def own_addresses() -> list[str]:
    """Return this machine's IPv4 addresses that others can reach, starting with the default route's."""
    import psutil

    found: dict[str, None] = {}
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        # connect() on a UDP socket sends no packet; it only selects the source address.
        probe.connect(("192.0.2.1", 9))
        found[str(probe.getsockname()[0])] = None
    for addresses in psutil.net_if_addrs().values():
        for each in addresses:
            if each.family == socket.AF_INET and not each.address.startswith("127."):
                found[each.address] = None
    found.pop("0.0.0.0", None)
    return list(found)


def host_names() -> list[str]:
    """Return the names under which other machines may reach this one: its host name and its mDNS name."""
    name = socket.gethostname()
    return [name, f"{name.partition('.')[0]}.local"]


def qr_code(text: str) -> str:
    """Return a QR code to print on a terminal, or "" if the segno library is missing."""
    try:
        import segno
    except ImportError:
        return ""
    out = io.StringIO()
    segno.make(text, micro=False).terminal(out, compact=True)
    return out.getvalue()


def _in_uri(address: str) -> str:
    return f"[{address}]" if ":" in address else address
