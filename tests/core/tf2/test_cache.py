"""TimeCache compared with a slow, readable reference."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.core.tf2.cache import Frame, Misfit, Sample, StaticCache, TimeCache

PARENTS = [Frame("a"), Frame("b")]


def sample(parent: Frame, x: float) -> Sample:
    return parent, x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0


@given(
    st.lists(st.tuples(st.integers(1, 60), st.sampled_from(PARENTS))),
    st.integers(1, 40),
    st.lists(st.integers(0, 70)),
)
def test_cache_answers_as_a_sorted_list_would(
    inserted: list[tuple[int, Frame]], span: int, times: list[int]
) -> None:
    cache = TimeCache(span)
    kept: dict[int, Frame] = {}
    for stamp, parent in inserted:
        misfit = cache.insert(stamp, sample(parent, float(stamp)))
        if kept and max(kept) > stamp + span:
            assert misfit is Misfit.OLD
        elif stamp in kept:
            assert misfit is Misfit.REPEATED
        else:
            assert misfit is None
            kept[stamp] = parent
            kept = {each: above for each, above in kept.items() if each >= max(kept) - span}

    assert len(cache) == len(kept)
    assert (cache.oldest, cache.newest) == ((min(kept), max(kept)) if kept else (0, 0))
    for time in times:
        found = cache.at(time)
        time = time or max(kept, default=0)  # noqa: PLW2901
        if not kept or not min(kept) <= time <= max(kept):
            assert found is None
            assert bool(cache.why_not(time)) == bool(kept)
            continue
        assert found is not None
        before, after = max(s for s in kept if s <= time), min(s for s in kept if s >= time)
        assert found[0] is kept[before]
        expected = time if kept[before] is kept[after] else before
        assert found[1] == pytest.approx(expected, abs=1e-9)


def test_memory_is_bounded_by_the_span() -> None:
    cache = TimeCache(100)
    for stamp in range(1, 10_000):
        cache.insert(stamp, sample(PARENTS[0], 0.0))
    assert len(cache) == 101
    assert len(cache._stamps) <= 2 * 101 + 1
    assert len(cache._samples) == len(cache._stamps)


def test_static_sample_is_replaced_and_survives_clearing() -> None:
    cache = StaticCache(sample(PARENTS[0], 1.0))
    cache.insert(5, sample(PARENTS[1], 2.0))
    cache.clear()
    assert cache.at(0) == cache.at(99) == sample(PARENTS[1], 2.0)
    assert cache.latest() == (0, PARENTS[1])
