"""Fair shares of a resource of the master, such as memory, among its clients.

Pure. ROS 1 has no users, and on loopback all clients have the same address. So a holder is the host and port of a
node's Slave API, which differ for each process.
"""

from __future__ import annotations

from enum import Enum

__all__ = ["Excess", "Shares", "holder_of"]


class Excess(Enum):
    """The limit that a holder would exceed."""

    ALL = "what all together may hold"
    ONE = "what one may hold"
    LARGE = "what is not kept for small holders"


class Shares:
    """The share of each holder in a limited resource, such as bytes or entries.

    One holder gets at most ``largest`` of ``most``. The last ``reserve`` is kept for holders with at most ``small``,
    so these always find room.
    """

    def __init__(self, most: int, largest: int, reserve: int, small: int) -> None:
        self.total = 0  # the sum over all holders
        self.most = most
        self.largest = largest
        self.small = small
        self.shared = most - reserve  # limit for all holders of more than ``small`` together
        self._held: dict[str, int] = {}

    def excess(self, holder: str, more: int) -> Excess | None:
        """Return the limit that prevents a holder from getting ``more``, or None."""
        held, total = self._held.get(holder, 0) + more, self.total + more
        if total > self.most:
            return Excess.ALL
        if held > self.largest:
            return Excess.ONE
        if held > self.small and total > self.shared:
            return Excess.LARGE
        return None

    def add(self, holder: str, more: int) -> None:
        """Count an amount that a holder gets, or returns (if negative)."""
        self.total += more
        held = self._held.get(holder, 0) + more
        if held:
            self._held[holder] = held
        else:
            self._held.pop(holder, None)


def holder_of(uri: str) -> str:
    """Return the host and port of a URI."""
    return uri.partition("://")[2].partition("/")[0]
