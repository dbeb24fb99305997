"""Deadlines of a fixed-rate loop, and statistics about its cycles. All times are in nanoseconds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

__all__ = ["MAX_CYCLES", "CycleTimes", "Spread", "spread"]

MAX_CYCLES = 100_000  # maximum number of cycles to keep between two reads: a few minutes' worth


class Spread(NamedTuple):
    """The distribution of some durations."""

    mean: float
    p99: int  # the 99th percentile
    longest: int


class CycleTimes:
    """Measures the cycles of a loop. The loop's thread calls :meth:`add`, and another thread calls :meth:`take`."""

    def __init__(self, period: int) -> None:
        self.period = period
        self.cycles = 0
        self.overruns = 0
        self._late: list[int] = []
        self._busy: list[int] = []

    def add(self, late: int, busy: int, is_overrun: bool) -> None:
        """Record a cycle: its delay ``late``, its duration ``busy``, and whether the next cycle's deadline was missed."""
        self.cycles += 1
        self.overruns += is_overrun
        if len(self._late) < MAX_CYCLES:
            self._late.append(late)
            self._busy.append(busy)

    def take(self) -> tuple[Sequence[int], Sequence[int]]:
        """Return the delays and durations of the cycles since the last call."""
        late, self._late = self._late, []
        busy, self._busy = self._busy, []
        return late, busy


def spread(durations: Sequence[int]) -> Spread:
    """Return the distribution of durations; zeros if there are none."""
    if not durations:
        return Spread(0.0, 0, 0)
    ordered = sorted(durations)
    return Spread(sum(ordered) / len(ordered), ordered[max(0, -(-99 * len(ordered) // 100) - 1)], ordered[-1])
