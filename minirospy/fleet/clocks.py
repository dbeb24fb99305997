"""Estimates a peer's clock offset from its replies, and measures the delays of messages. Pure. Times are in nanoseconds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

__all__ = ["ClockOffset", "Delay", "Ping", "offset_of"]

_SHARE = 0.1  # weight of the newest message in the mean delay


class Ping(NamedTuple):
    """A ping: the local times of the request and the reply, and the peer's time in the reply."""

    sent: int
    theirs: int
    received: int


class ClockOffset(NamedTuple):
    """The offset of a peer's clock: subtract ``offset`` from the peer's times to get local times.

    The error of the offset is at most half the round trip.
    """

    offset: int
    round_trip: int


@dataclass
class Delay:
    """The exponentially weighted mean and the maximum of the delays of a topic's messages."""

    mean: float = 0.0
    longest: int = 0
    count: int = 0

    def add(self, delay: int) -> None:
        """Record a message's delay. Count a negative delay, which an inexact clock offset can cause, as 0."""
        delay = max(0, delay)
        self.mean = delay if not self.count else self.mean + _SHARE * (delay - self.mean)
        self.longest = max(self.longest, delay)
        self.count += 1


def offset_of(pings: Iterable[Ping]) -> ClockOffset | None:
    """Return the offset of the peer's clock, from the reply with the shortest round trip, or None without a reply."""
    best = min(pings, key=lambda ping: ping.received - ping.sent, default=None)
    if best is None:
        return None
    return ClockOffset(best.theirs - (best.sent + best.received) // 2, best.received - best.sent)
