"""Fair shares of one of the master's resources, such as memory, among its clients.

Pure. ROS 1 has no users, and on loopback all clients have the same address. Therefore a holder is identified by the host
and port of a node's Slave API, which differ for each process.
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
    """Each holder's share of a limited resource, such as bytes or entries.

    One holder gets at most ``largest`` out of ``most``. The last ``reserve`` of the resource is only for holders that
    have at most ``small``, so that these holders can always get more.
    """

    def __init__(self, most: int, largest: int, reserve: int, small: int) -> None:
        self.total = 0  # the sum over all holders
        self.most = most
        self.largest = largest
        self.small = small
        self.shared = most - reserve  # a holder may exceed ``small`` only if the total stays within this
        self._held: dict[str, int] = {}

    def excess(self, holder: str, more: int) -> Excess | None:
        """Return the limit that prevents a holder from getting ``more``, or None if there is none."""
        held, total = self._held.get(holder, 0) + more, self.total + more
        if total > self.most:
            return Excess.ALL
        if held > self.largest:
            return Excess.ONE
        if held > self.small and total > self.shared:
            return Excess.LARGE
        return None

    def add(self, holder: str, more: int) -> None:
        """Add the amount ``more`` to a holder's share, or remove it if negative."""
        self.total += more
        held = self._held.get(holder, 0) + more
        if held:
            self._held[holder] = held
        else:
            self._held.pop(holder, None)


def holder_of(uri: str) -> str:
    """Return the host and port in a URI."""
    return uri.partition("://")[2].partition("/")[0]
