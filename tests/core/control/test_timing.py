"""Statistics about a loop's cycles."""

from __future__ import annotations

from minirospy.core.control.timing import MAX_CYCLES, CycleTimes, Spread, spread


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


def test_cycles_that_nothing_takes_do_not_fill_the_memory() -> None:
    times = CycleTimes(1000)
    for _ in range(MAX_CYCLES + 5):
        times.add(1, 2, False)
    assert times.cycles == MAX_CYCLES + 5
    assert len(times.take()[0]) == MAX_CYCLES
