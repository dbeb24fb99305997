"""Fair shares of what all clients together may have the master hold.

Pure. ROS 1 has no users, and on loopback all clients have one address: a holder is the host and port of a node's
Slave API, of which each process has its own.
"""

from __future__ import annotations

from enum import Enum

__all__ = ["Excess", "Shares", "holder_of"]


class Excess(Enum):
    """The limit that a holder would be beyond."""

    ALL = "what all together may hold"
    ONE = "what one may hold"
    LARGE = "what is not kept for small holders"


class Shares:
    """The share of each holder in something that is limited: bytes, or entries.

    One holder gets ``largest`` of ``most``. The last ``reserve`` is kept for those that have no more than ``small``,
    so these find room whatever the others hold.
    """

    def __init__(self, most: int, largest: int, reserve: int, small: int) -> None:
        self.total = 0
        """What all of them hold."""
        self.most = most
        self.largest = largest
        self.small = small
        self.shared = most - reserve
        """What holders of more than ``small`` have together."""
        self._held: dict[str, int] = {}

    def excess(self, holder: str, more: int) -> Excess | None:
        """Return the limit that does not let a holder have ``more``, or None."""
        held, total = self._held.get(holder, 0) + more, self.total + more
        if total > self.most:
            return Excess.ALL
        if held > self.largest:
            return Excess.ONE
        if held > self.small and total > self.shared:
            return Excess.LARGE
        return None

    def add(self, holder: str, more: int) -> None:
        """Count what a holder gets, or gives back (below zero)."""
        self.total += more
        held = self._held.get(holder, 0) + more
        if held:
            self._held[holder] = held
        else:
            self._held.pop(holder, None)


def holder_of(uri: str) -> str:
    """Return the host and port of a URI."""
    return uri.partition("://")[2].partition("/")[0]
