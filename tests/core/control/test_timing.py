"""Statistics about a loop's cycles."""

from __future__ import annotations

from minirospy.core.control.timing import CycleTimes, Spread, spread


def test_spread() -> None:
    assert spread([]) == Spread(0.0, 0, 0)
    assert spread([5]) == Spread(5.0, 5, 5)
    assert spread(range(200, 0, -1)) == Spread(100.5, 198, 200)


def test_cycles_are_counted_and_taken_once() -> None:
    times = CycleTimes(1000)
    times.add(3, 10, False)
    times.add(5, 2000, True)
    assert (times.cycles, times.overruns) == (2, 1)
    assert times.take() == ([3, 5], [10, 2000])
    assert times.take() == ([], [])
