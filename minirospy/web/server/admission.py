"""Select a connection to close when a new one arrives and the maximum number is reached. Pure.

An attacker occupies connections: it opens them and sends no request, or is served and then sends nothing, or only a little
now and then. It has few addresses and no token. Therefore connections are closed in this order:

1. a connection without a request, if it is older than some seconds or its address has too many such connections;
2. a client that has sent and received nothing for some time: the longest idle one at the address with the most connections;
3. for an address with few connections, a client of an address that has more than half of all connections;
4. for the owner, any client of another user.

A client is closed only for a connection whose rights are at least equal.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from enum import IntEnum
from typing import Protocol, TypeVar

from minirospy.web.access import Grant

__all__ = ["Occupant", "Rank", "displaced", "rank_of"]

# seconds that a client has to send its request; browsers open some connections in advance
SILENT_SECONDS = 5.0
# maximum number of connections per address that have not sent a request yet; a browser opens six
MAX_SILENT = 16
# seconds without traffic after which a client counts as idle; the dashboard's pages always have traffic sooner
IDLE_SECONDS = 30.0
FEW = 8  # an address has few connections if it has less than 1/FEW of all connections


class Rank(IntEnum):
    """The rank of a connection, which depends on the client's rights, if they are known."""

    SILENT = 0
    """The client has sent no request yet."""
    READ = 1
    WRITE = 2
    OWN = 3
    """The client has the owner's token, or belongs to the server's user."""


def rank_of(grant: Grant) -> Rank:
    """Return the rank of a client with these rights."""
    return {Grant.READ: Rank.READ, Grant.WRITE: Rank.WRITE, Grant.OWN: Rank.OWN}[grant]


class Occupant(Protocol):
    """A connection that has been admitted."""

    @property
    def peer(self) -> str:
        """The peer's address."""

    @property
    def rank(self) -> Rank: ...

    @property
    def active(self) -> float:
        """When the connection was opened, or last sent or received a message. Uses the same clock as ``now``."""


_O = TypeVar("_O", bound=Occupant)


def displaced(peer: str, rank: Rank, occupants: Iterable[_O], now: float) -> _O | None:
    """Return the connection to close in favour of a new one from ``peer``, or None if there is none."""
    found = list(occupants)
    silent = [each for each in found if each.rank is Rank.SILENT]
    old = [each for each in silent if now - each.active >= SILENT_SECONDS]
    if old:
        return _oldest(old)
    of_address = Counter(each.peer for each in silent)
    if many := [each for each in silent if of_address[each.peer] > MAX_SILENT]:
        return _oldest(_of_heaviest(many))
    if rank is Rank.SILENT:
        return None

    served = [each for each in found if Rank.SILENT < each.rank <= rank]
    if idle := [each for each in served if now - each.active >= IDLE_SECONDS]:
        return _oldest(_of_heaviest(idle))

    addresses = Counter(each.peer for each in found)
    strangers = [each for each in found if each.rank < Rank.OWN]
    if rank is Rank.OWN and strangers:
        return _oldest(_of_heaviest(strangers))
    if addresses[peer] * FEW < len(found):
        greedy = [each for each in served if each.rank < Rank.OWN and 2 * addresses[each.peer] > len(found)]
        if greedy:
            return _oldest(greedy)
    return None


def _of_heaviest(occupants: list[_O]) -> list[_O]:
    """Return the connections from the address with the most connections."""
    counts = Counter(each.peer for each in occupants)
    heaviest = max(counts, key=counts.__getitem__)
    return [each for each in occupants if each.peer == heaviest]


def _oldest(occupants: list[_O]) -> _O:
    return min(occupants, key=lambda each: each.active)
