"""The registry's limits: the memory for all registrations, and the share that the nodes on one host and port may use.

Pure. Sizes are those in 64-bit CPython; each registered name is in up to four tables.
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

# maximum total bytes of all registrations in memory: about 60,000 nodes with one topic each
MAX_BYTES = 64 * _MIB

MAX_OF_ONE = 32 * _MIB  # maximum bytes in memory of the registrations from one host and port

RESERVE = 16 * _MIB
"""Part of MAX_BYTES reserved for hosts and ports that use at most FEW_OF_ONE, about 300 topics and services."""

FEW_OF_ONE = _MIB // 4

MAX_ENTRIES = 10_000  # maximum number of topics, services and parameters per node

# Approximate bytes for a node, and for each name that it registers, excluding their strings
_NODE_BYTES, _NAME_BYTES = 400, 150

PUBLISHES, SUBSCRIBES, SERVES, PARAMETER = 1, 2, 4, 8  # kinds of registration for a name, as bits

# bytes per registration of each kind
_KIND_BYTES = {PUBLISHES: 200, SUBSCRIBES: 200, SERVES: 200, PARAMETER: 400}


class RegistryFullError(MinirospyError):
    """A registration would exceed a limit, described by ``limit``."""

    def __init__(self, limit: str) -> None:
        super().__init__(limit)
        self.limit = limit

    def __str__(self) -> str:
        return f"the registration is beyond the limit of {self.limit}"


def new_shares() -> Shares:
    """Return empty shares of the registration memory, for each host and port."""
    return Shares(MAX_BYTES, MAX_OF_ONE, RESERVE, FEW_OF_ONE)


def describe(excess: Excess, shares: Shares) -> str:
    """Describe the limit that was exceeded."""
    match excess:
        case Excess.ALL:
            return f"{shares.most // _MIB} MiB for all registrations"
        case Excess.ONE:
            return f"{shares.largest // _MIB} MiB for the registrations of one host and port"
        case Excess.LARGE:
            return f"{shares.shared // _MIB} MiB for the registrations of all that have many"


def text_cost(text: str) -> int:
    """Return the bytes of memory that a string uses.

    sys.getsizeof would be inexact: Python caches a string's UTF-8 encoding once it is needed, for example for the journal.
    """
    return 50 + len(text) if text.isascii() else 80 + 8 * len(text)


def node_cost(name: str, uri: str) -> int:
    """Return the bytes of memory that a node uses."""
    return _NODE_BYTES + text_cost(name) + text_cost(uri)


def name_cost(name: str, kind: int, kinds: int) -> int:
    """Return the bytes needed to register a name as ``kind`` if it is already registered as the kinds in ``kinds``."""
    if kinds & kind:
        return 0
    text = text_cost(name)
    # Count a parameter's name again, because the parameter server has a separate copy.
    size = _KIND_BYTES[kind] + (text if kind == PARAMETER else 0)
    return size if kinds else size + _NAME_BYTES + text
