"""The parameter cache never returns a value older than the last change."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.core.graph.parameter_cache import NOT_SET, ParameterCache
from minirospy.core.graph.parameters import ParameterTree

KEYS = ["/", "/a", "/a/b", "/a/b/c", "/ab", "/x"]


@pytest.mark.parametrize(
    ("changed", "forgotten"),
    [
        ("/a/b", {"/", "/a", "/a/b", "/a/b/c"}),
        ("/a/b/", {"/", "/a", "/a/b", "/a/b/c"}),
        ("/a/b/c/d", {"/", "/a", "/a/b", "/a/b/c"}),
        ("/ab", {"/", "/ab"}),
        ("/", set(KEYS)),
        ("/y", {"/"}),
    ],
)
def test_a_change_concerns_parents_and_children(changed: str, forgotten: set[str]) -> None:
    cache = ParameterCache()
    for key in KEYS:
        cache.store(key, 1, cache.changes)
    cache.changed(changed)

    for key in KEYS:
        if key in forgotten:
            with pytest.raises(LookupError):
                cache.get(key)
        else:
            assert cache.get(key) == 1


def test_an_answer_that_was_overtaken_by_a_change_is_not_kept() -> None:
    cache = ParameterCache()
    changes = cache.changes
    cache.changed("/a")
    cache.store("/a", "old", changes)
    with pytest.raises(LookupError):
        cache.get("/a")


steps = st.lists(
    st.one_of(
        st.tuples(
            st.just("set"), st.sampled_from(KEYS[1:]), st.sampled_from([1, 2, {}, {"b": 3}, {"b": {"c": 4}}])
        ),
        st.tuples(st.just("delete"), st.sampled_from(KEYS[1:]), st.none()),
        st.tuples(st.just("read"), st.sampled_from(KEYS), st.none()),
    )
)


@given(steps)
def test_cached_parameters_match_the_master(program: list[tuple[str, str, object]]) -> None:
    tree, cache, subscribed = ParameterTree(), ParameterCache(), set[str]()

    for verb, key, value in program:
        if verb == "read":
            if key not in subscribed:
                tree.subscribe(key, "/reader", "http://reader")
                subscribed.add(key)
            truth = tree.get(key) if tree.has(key) else NOT_SET
            try:
                assert cache.get(key) == truth
            except LookupError:
                cache.store(key, truth, cache.changes)
            continue

        try:
            updates = tree.set(key, value, "/writer") if verb == "set" else tree.delete(key)
        except KeyError:
            continue
        for update in updates:
            cache.changed(update.key)
