"""The account of a server's memory: what it holds for its clients, with a share for each. Pure.

Unfinished messages, fragments, operations that wait, and queued output count, for all clients of all listeners together. Beyond
the limit the client that holds the most, at the address that holds the most, has to give up what it holds: first messages that
may be dropped, then its connection. Clients of the owner come last. So no client can take the memory, nor another client's place.

Pieces that are large may wait for many clients at the same time, as the images of a camera do: they count once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

__all__ = ["LARGE_PIECE", "MAX_BYTES", "Account", "Share"]

MAX_BYTES = 160_000_000
"""Bytes that a server holds for all clients: the process stays under 400 MB, with copies while a message is handled."""

LARGE_PIECE = 32_768
"""Bytes from which a piece is counted once, however many clients it waits for."""

Piece = bytes | memoryview | bytearray


class Share:
    """What one client holds."""

    def __init__(self, account: Account, address: str, shed: Callable[[], object]) -> None:
        self.address = address
        self.is_owner = False
        """Set once the client has proved to be the owner: its share is the last to be shed."""
        self.size = 0
        """Bytes that the client holds alone."""
        self.large = 0
        """Bytes of the large pieces that wait for it, which may wait for others, too."""
        self.shed = shed
        """Gives up some of what the client holds, or all."""
        self._account = account

    @property
    def weight(self) -> int:
        """Return all bytes that the client holds, alone or with others."""
        return self.size + self.large

    def set(self, size: int) -> None:
        """Set the bytes that the client holds alone, and let clients give up memory if there is too much."""
        grown = size - self.size
        if grown:
            self.size = size
            self._account.total += grown
            if grown > 0:
                self._account.enforce()

    def hold(self, pieces: Sequence[Piece]) -> None:
        """Count the large ones of these pieces."""
        self.large += self._account.hold(pieces)

    def release(self, pieces: Sequence[Piece]) -> None:
        """Count them no more; they are the same objects that were held."""
        self.large -= self._account.release(pieces)


class Account:
    """The memory of all clients of a server. On the loop."""

    def __init__(self, limit: int = MAX_BYTES) -> None:
        self.limit = limit
        self.total = 0
        """Bytes that are held now."""
        self.shed = 0
        """How often a client had to give up memory."""
        self._shares: set[Share] = set()
        self.holders: Counter[int] = Counter()
        """How often a large piece waits, by the id of the object, which exists as long as it waits."""
        self._is_enforcing = False

    def open(self, address: str, shed: Callable[[], object]) -> Share:
        """Return the share of a new client; ``shed`` is called when it has to give up what it holds."""
        share = Share(self, address, shed)
        self._shares.add(share)
        return share

    def close(self, share: Share) -> None:
        """Forget a client, whose pieces have been released. Idempotent."""
        self._shares.discard(share)
        self.total -= share.size
        share.size = 0

    def hold(self, pieces: Sequence[Piece]) -> int:
        """Count the large ones of these pieces; return their bytes."""
        found = 0
        for piece in pieces:
            size = len(piece)
            if size >= LARGE_PIECE:
                found += size
                self.holders[id(piece)] += 1
                if self.holders[id(piece)] == 1:
                    self.total += size
        return found

    def release(self, pieces: Sequence[Piece]) -> int:
        """Count pieces that were held once less; return the bytes of the large ones."""
        found = 0
        for piece in pieces:
            size = len(piece)
            if size >= LARGE_PIECE:
                found += size
                self.holders[id(piece)] -= 1
                if not self.holders[id(piece)]:
                    del self.holders[id(piece)]
                    self.total -= size
        return found

    def enforce(self) -> None:
        """Have clients give up memory until the limit is kept."""
        if self._is_enforcing:
            return  # what is shed calls this again
        self._is_enforcing = True
        try:
            while self.total > self.limit:
                share = self.heaviest()
                if share is None:
                    return
                before = share.weight
                self.shed += 1
                share.shed()
                if share.weight >= before:
                    # It holds on to what it has: it must not be chosen for ever.
                    self.close(share)
        finally:
            self._is_enforcing = False

    def heaviest(self) -> Share | None:
        """Return the client that has to give up memory; None if no client holds any."""
        holding = [share for share in self._shares if share.weight]
        holding = [share for share in holding if not share.is_owner] or holding
        if not holding:
            return None
        addresses: Counter[str] = Counter()
        for share in holding:
            addresses[share.address] += share.weight
        address = max(addresses, key=addresses.__getitem__)
        return max((share for share in holding if share.address == address), key=lambda share: share.weight)
