"""How far a peer's clock is from ours, by its answers, and how long messages take. Pure. Times in nanoseconds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

__all__ = ["ClockOffset", "Delay", "Ping", "offset_of"]

_SHARE = 0.1
"""What one message counts in the mean delay."""


class Ping(NamedTuple):
    """A request that we sent and whose answer we received by our clock, and the peer's time in its answer."""

    sent: int
    theirs: int
    received: int


class ClockOffset(NamedTuple):
    """What to subtract from the peer's times to get ours, and the round trip: the offset is right within its half."""

    offset: int
    round_trip: int


@dataclass
class Delay:
    """The delays of a topic's messages: the mean, in which new ones count more, and the longest."""

    mean: float = 0.0
    longest: int = 0
    count: int = 0

    def add(self, delay: int) -> None:
        """Count a message; an offset that is not exact may give a delay below zero, which is none."""
        delay = max(0, delay)
        self.mean = delay if not self.count else self.mean + _SHARE * (delay - self.mean)
        self.longest = max(self.longest, delay)
        self.count += 1


def offset_of(pings: Iterable[Ping]) -> ClockOffset | None:
    """Return the peer's offset by the fastest answer, which waited least; None without an answer."""
    best = min(pings, key=lambda ping: ping.received - ping.sent, default=None)
    if best is None:
        return None
    return ClockOffset(best.theirs - (best.sent + best.received) // 2, best.received - best.sent)
