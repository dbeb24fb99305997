"""Which connection gives way to a new one where there is room for no more. Pure.

An attacker holds connections: it opens them and sends nothing, or is served and does nothing, or a little now and then. It has
few addresses and no token. So, in this order:

1. a connection without a request that is older than some seconds, or of which its address has too many;
2. a client that has sent and received nothing for some time: of the address with the most connections, the longest idle;
3. any client of an address that has more than half of all connections, for an address that has few;
4. for the owner any client of another one.

A client gives way only to one with at least its rights.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from enum import IntEnum
from typing import Protocol, TypeVar

from minirospy.web.access import Grant

__all__ = ["Occupant", "Rank", "displaced", "rank_of"]

SILENT_SECONDS = 5.0  # a client sends its request with its connection; a browser opens some in advance
MAX_SILENT = 16  # connections of an address without a request that may be younger; a browser opens six
IDLE_SECONDS = 30.0  # pages have something to send or to show more often
FEW = 8  # an address has few connections if it has less than an eighth of all


class Rank(IntEnum):
    """The rights of a connection, as far as they are known."""

    SILENT = 0
    """It has sent no request."""
    READ = 1
    WRITE = 2
    OWN = 3
    """It has the read-write token, or belongs to the user of the server."""


def rank_of(grant: Grant) -> Rank:
    """Return the rank of a client by its rights."""
    return {Grant.READ: Rank.READ, Grant.WRITE: Rank.WRITE, Grant.OWN: Rank.OWN}[grant]


class Occupant(Protocol):
    """A connection that has a place."""

    @property
    def peer(self) -> str:
        """The address of the other end."""

    @property
    def rank(self) -> Rank: ...

    @property
    def active(self) -> float:
        """When it was opened, or sent a message, or took one: by the same clock as ``now``."""


_O = TypeVar("_O", bound=Occupant)


def displaced(peer: str, rank: Rank, occupants: Iterable[_O], now: float) -> _O | None:
    """Return the connection that gives way to one from ``peer``; None if there is none."""
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
    """Return those of the address that has the most of them."""
    counts = Counter(each.peer for each in occupants)
    heaviest = max(counts, key=counts.__getitem__)
    return [each for each in occupants if each.peer == heaviest]


def _oldest(occupants: list[_O]) -> _O:
    return min(occupants, key=lambda each: each.active)
