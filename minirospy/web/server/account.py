"""Accounting of the memory that a server uses for its clients, with a share for each client. Pure.

Unfinished messages, fragments, queued operations and queued output count, for all clients of all listeners together. If
the limit is exceeded, the client that uses the most memory, at the address that uses the most, has to release memory:
first messages that may be dropped, then its connection. The owner's clients are chosen last. Therefore no client can
use up the memory, or cause another client to be disconnected.

A large piece, such as a camera image, that is queued for many clients counts only once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

__all__ = ["LARGE_PIECE", "MAX_BYTES", "Account", "Share"]

MAX_BYTES = 160_000_000
"""Maximum memory in bytes that a server uses for all clients together.

The process stays below 400 MB, including copies while it handles a message.
"""

LARGE_PIECE = 32_768
"""Minimum size in bytes of a large piece, which is counted only once even if it is queued for many clients."""

Piece = bytes | memoryview | bytearray


class Share:
    """The memory that one client uses."""

    def __init__(self, account: Account, address: str, shed: Callable[[], object]) -> None:
        self.address = address
        self.is_owner = False
        """True once the client has proved to be the owner. Its memory is then reduced last."""
        self.size = 0
        """Bytes that only this client uses."""
        self.large = 0
        """Total bytes of the large pieces queued for this client. Other clients may share the same pieces."""
        self.shed = shed
        """Called to release some or all of the client's memory."""
        self._account = account

    @property
    def weight(self) -> int:
        """Return the number of bytes that the client uses, including large pieces shared with other clients."""
        return self.size + self.large

    def set(self, size: int) -> None:
        """Set how many bytes this client alone uses. If all clients together exceed the limit, make some release memory."""
        grown = size - self.size
        if grown:
            self.size = size
            self._account.total += grown
            if grown > 0:
                self._account.enforce()

    def hold(self, pieces: Sequence[Piece]) -> None:
        """Count the large pieces among ``pieces`` as in use."""
        self.large += self._account.hold(pieces)

    def release(self, pieces: Sequence[Piece]) -> None:
        """Stop counting pieces, which must be the same objects that were passed to :meth:`hold`."""
        self.large -= self._account.release(pieces)


class Account:
    """The memory that all clients of a server use. Runs on the loop."""

    def __init__(self, limit: int = MAX_BYTES) -> None:
        self.limit = limit
        self.total = 0
        """Total bytes in use."""
        self.shed = 0
        """Number of times that a client had to release memory."""
        self._shares: set[Share] = set()
        self.holders: Counter[int] = Counter()
        """Number of queues that contain each large piece, keyed by the object's id. The id is valid because a queue keeps
        the object alive.
        """
        self._is_enforcing = False

    def open(self, address: str, shed: Callable[[], object]) -> Share:
        """Add a client; return its share. ``shed`` is called when the client must release memory."""
        share = Share(self, address, shed)
        self._shares.add(share)
        return share

    def close(self, share: Share) -> None:
        """Remove a client's share, whose pieces must have been released before. Idempotent."""
        self._shares.discard(share)
        self.total -= share.size
        share.size = 0

    def hold(self, pieces: Sequence[Piece]) -> int:
        """Count the large pieces among ``pieces`` as in use; return their total size in bytes."""
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
        """Stop counting pieces passed to :meth:`hold`; return the total size of the large ones in bytes."""
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
        """Make clients release memory until the total does not exceed the limit."""
        if self._is_enforcing:
            return  # releasing memory calls this method again
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
                    # The client has not released anything, so remove it: otherwise it would be chosen again and again.
                    self.close(share)
        finally:
            self._is_enforcing = False

    def heaviest(self) -> Share | None:
        """Return the share of the client that must release memory next, or None if no client uses memory."""
        holding = [share for share in self._shares if share.weight]
        holding = [share for share in holding if not share.is_owner] or holding
        if not holding:
            return None
        addresses: Counter[str] = Counter()
        for share in holding:
            addresses[share.address] += share.weight
        address = max(addresses, key=addresses.__getitem__)
        return max((share for share in holding if share.address == address), key=lambda share: share.weight)
