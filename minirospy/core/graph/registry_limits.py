"""The limits of the registry: how much memory registrations take, and how much of it the nodes of one client get.

Pure. Sizes are those of CPython on 64 bits: a name that is registered is in up to four tables.
"""

from __future__ import annotations

from minirospy.base.errors import MinirospyError
from minirospy.core.graph.shares import Excess, Shares

__all__ = [
    "PARAMETER",
    "PUBLISHES",
    "SERVES",
    "SUBSCRIBES",
    "RegistryFullError",
    "describe",
    "name_cost",
    "new_shares",
    "node_cost",
    "text_cost",
]

_MIB = 1024 * 1024

MAX_BYTES = 64 * _MIB
"""What all registrations together may take in memory: about 60,000 nodes of one topic each."""

MAX_OF_ONE = 32 * _MIB
"""The same of one host and port."""

RESERVE = 16 * _MIB
"""What is left to hosts and ports that have no more than FEW_OF_ONE, some 300 topics and services."""

FEW_OF_ONE = _MIB // 4

MAX_ENTRIES = 10_000
"""Topics, services and parameters that one node may register."""

_NODE_BYTES, _NAME_BYTES = 400, 150
"""What a node and each name that it registers take beside their texts, about."""

PUBLISHES, SUBSCRIBES, SERVES, PARAMETER = 1, 2, 4, 8
"""What a name may be to a node."""

_KIND_BYTES = {PUBLISHES: 200, SUBSCRIBES: 200, SERVES: 200, PARAMETER: 400}
"""What that takes."""


class RegistryFullError(MinirospyError):
    """A registration would be beyond a limit, which ``limit`` names."""

    def __init__(self, limit: str) -> None:
        super().__init__(limit)
        self.limit = limit

    def __str__(self) -> str:
        return f"the registration is beyond the limit of {self.limit}"


def new_shares() -> Shares:
    """Return the bytes that the nodes of each host and port may take, none of them in use."""
    return Shares(MAX_BYTES, MAX_OF_ONE, RESERVE, FEW_OF_ONE)


def describe(excess: Excess, shares: Shares) -> str:
    """Return a limit as text."""
    match excess:
        case Excess.ALL:
            return f"{shares.most // _MIB} MiB for all registrations"
        case Excess.ONE:
            return f"{shares.largest // _MIB} MiB for the registrations of one host and port"
        case Excess.LARGE:
            return f"{shares.shared // _MIB} MiB for the registrations of all that have many"


def text_cost(text: str) -> int:
    """Return the bytes that a text takes.

    Not by sys.getsizeof: Python adds a copy as UTF-8 to a text while it is in use, once a journal needed it.
    """
    return 50 + len(text) if text.isascii() else 80 + 8 * len(text)


def node_cost(name: str, uri: str) -> int:
    """Return the bytes that a node takes."""
    return _NODE_BYTES + text_cost(name) + text_cost(uri)


def name_cost(name: str, kind: int, kinds: int) -> int:
    """Return the bytes that a node takes for being ``kind`` under a name where it is ``kinds`` already."""
    if kinds & kind:
        return 0
    text = text_cost(name)
    # The parameter server has its own copy.
    size = _KIND_BYTES[kind] + (text if kind == PARAMETER else 0)
    return size if kinds else size + _NAME_BYTES + text
