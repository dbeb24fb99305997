"""core/graph/parameters: the parameter tree without a server."""

from __future__ import annotations

import gc
import tracemalloc
from sys import getsizeof
from types import CellType
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.steps import finish
from minirospy.core.graph import parameters
from minirospy.core.graph.parameters import (
    ParametersFullError,
    ParameterTree,
    ParameterUpdate,
    weigh_in_steps,
)

MIB = 1024 * 1024


def tree_of(**values: Any) -> ParameterTree:
    tree = ParameterTree()
    for name, value in values.items():
        list(tree.set("/" + name, value, ""))
    return tree


def test_a_value_is_found_below_its_namespace() -> None:
    tree = tree_of()
    tree.set("/a/b/c", 1, "")
    assert tree.get("/a") == {"b": {"c": 1}}
    assert tree.get("/a/b/c/") == 1
    assert tree.has("/a/b")
    assert not tree.has("/a/b/c/d")
    with pytest.raises(KeyError):
        tree.get("/a/x")
    assert tree.names() == ["/a/b/c"]


def test_a_dictionary_replaces_a_namespace_and_a_value_in_the_way_goes() -> None:
    tree = tree_of(a={"x": 1, "y": 2}, b=5)
    tree.set("/a", {"z": 3}, "")
    tree.set("/b/c", 6, "")
    assert tree.get("/") == {"a": {"z": 3}, "b": {"c": 6}}
    with pytest.raises(ValueError, match="root"):
        tree.set("/", 5, "")


def test_delete() -> None:
    tree = tree_of(a={"x": 1, "y": 2})
    tree.delete("/a/x")
    assert tree.get("/") == {"a": {"y": 2}}
    for key in ("/", "/b", "/a/x", "/a/y/z"):
        with pytest.raises(KeyError):
            tree.delete(key)


def test_search_goes_upwards() -> None:
    tree = ParameterTree()
    tree.set("/x", 1, "")
    tree.set("/a/x", 2, "")
    assert tree.search("/a/b/node", "x") == "/a/x"
    assert tree.search("/c", "x") == "/x"
    assert tree.search("/a", "x/later") == "/a/x/later"
    assert tree.search("/a", "/x") == "/x"
    assert tree.search("/a", "y") is None
    assert tree.search("/a", "/y") is None


def test_returned_values_are_not_changed_by_later_calls() -> None:
    tree = tree_of(a={"b": {"c": 1}, "l": [1]})
    before, inner = tree.get("/"), tree.get("/a/b")
    tree.set("/a/b/c", 2, "")
    tree.set("/a/b/d", 3, "")
    tree.delete("/a/l")
    assert before == {"a": {"b": {"c": 1}, "l": [1]}}
    assert inner == {"c": 1}
    assert tree.get("/") == {"a": {"b": {"c": 2, "d": 3}}}


KEYS = st.lists(st.sampled_from("abc"), max_size=3).map(lambda parts: "/" + "/".join(parts))
VALUES = st.integers(0, 3) | st.dictionaries(st.sampled_from("abc"), st.integers(0, 3), max_size=2)


@given(st.lists(st.tuples(st.sampled_from(["set", "delete", "get"]), KEYS, VALUES), max_size=20))
def test_any_calls_leave_what_was_returned_as_it_was(calls: list[tuple[str, str, Any]]) -> None:
    tree, returned = ParameterTree(), []
    oracle: dict[str, Any] = {}

    for what, key, value in calls:
        path = [part for part in key.split("/") if part]

        if what == "set" and path:
            tree.set(key, value, "")
            table = oracle
            for part in path[:-1]:
                if not isinstance(table.get(part), dict):
                    table[part] = {}
                table = table[part]
            table[path[-1]] = value.copy() if isinstance(value, dict) else value
        elif what == "delete" and tree.has(key) and path:
            tree.delete(key)
            table = oracle
            for part in path[:-1]:
                table = table[part]
            del table[path[-1]]
        elif tree.has(key):
            found = tree.get(key)
            returned.append((found, repr(found)))

    assert tree.get("/") == oracle
    assert all(repr(found) == text for found, text in returned)


# --- subscriptions


def test_updates_go_to_the_subscribers_above_and_below() -> None:
    tree = tree_of(a={"b": 1})
    assert tree.subscribe("/a", "/n1", "u1") == {"b": 1}
    assert tree.subscribe("/a/b", "/n2", "u2") == 1
    assert tree.subscribe("/a/b/c", "/n3", "u3") == {}
    assert tree.subscribe("/ab", "/n4", "u4") == {}
    assert list(tree.set("/a/b", 2, "/n1")) == [
        ParameterUpdate("u2", "/a/b/"),
        ParameterUpdate("u3", "/a/b/c/"),
    ]
    # The node that set the namespace is not notified of that, only of the change to a parameter inside.
    assert list(tree.set("/a", {"b": 3}, "/n2")) == [
        ParameterUpdate("u1", "/a/"),
        ParameterUpdate("u2", "/a/b/"),
        ParameterUpdate("u3", "/a/b/c/"),
    ]
    assert list(tree.delete("/a/b")) == [
        ParameterUpdate("u1", "/a/b/"),
        ParameterUpdate("u2", "/a/b/"),
        ParameterUpdate("u3", "/a/b/c/"),
    ]


def test_unsubscribe() -> None:
    tree = tree_of()
    tree.subscribe("/a", "/n", "u")
    tree.subscribe("/b", "/n", "u")
    tree.subscribe("/b", "/m", "u")
    assert tree.unsubscribe("/a", "/n", "u")
    assert tree.unsubscribe("/a", "/n", "u") is False
    assert not tree.unsubscribe("/b", "/n", "other")
    assert tree.subscribed_keys("u") == ["/b/"]
    tree.unsubscribe_node("/n", "u")
    assert list(tree.subscriptions()) == [("/m", "u", "/b/")]
    assert tree.count_subscriptions() == 1
    assert list(tree.set("/a", 1, "")) == []
    tree.unsubscribe_node("/m", "u")
    assert tree.subscribed_keys("u") == []


def test_update_survives_subscribers_that_change_meanwhile() -> None:
    tree = tree_of(a={"x": 1})
    for number in range(5):
        tree.subscribe(f"/a/k{number}", "/n", f"u{number}")
    updates = tree.set("/a", {}, "")
    assert next(updates).uri == "u0"
    tree.unsubscribe("/a/k1", "/n", "u1")
    tree.subscribe("/a/k9", "/n", "u9")
    assert [update.uri for update in updates] == ["u2", "u3", "u4", "u9"]


# --- limits


def test_a_full_tree_refuses_and_forgets_what_was_replaced() -> None:
    tree = ParameterTree(most=4 * MIB, reserve=0)
    value = "x" * MIB
    weight = finish(weigh_in_steps("/p", value))
    assert MIB < weight < 1.1 * MIB
    for _ in range(20):
        finish(tree.make_room(weight))
        tree.set("/same", value, "", weight)
    for number in range(2):
        finish(tree.make_room(weight))
        tree.set(f"/p{number}", value, "", weight)
    with pytest.raises(ParametersFullError, match="full: no more than 4 MiB"):
        finish(tree.make_room(weight))
    tree.delete("/p0")
    finish(tree.make_room(weight))
    assert tree.has_room(weight)


def test_too_many_subscriptions_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("MAX_SUBSCRIPTIONS", 9), ("MAX_OF_ONE", 5), ("FEW_RESERVE", 2), ("FEW", 1)):
        monkeypatch.setattr(parameters, name, value)
    tree = tree_of()
    for number in range(5):
        tree.subscribe("/a", f"/n{number}", f"http://bad:1/{number}")
    with pytest.raises(ParametersFullError, match="no more than 5 subscriptions of one host and port"):
        tree.subscribe("/a", "/n6", "http://bad:1/")
    # An existing subscription may be repeated.
    tree.subscribe("/a", "/n0", "http://bad:1/0")
    tree.subscribe("/a", "/other", "http://bad:2/")
    tree.subscribe("/b", "/other", "http://bad:2/")
    with pytest.raises(ParametersFullError, match="no more than 7 subscriptions of all that have many"):
        tree.subscribe("/c", "/other", "http://bad:2/")
    # Other clients can still subscribe.
    tree.subscribe("/a", "/good1", "http://good:1/")
    tree.subscribe("/a", "/good2", "http://good:2/")
    with pytest.raises(ParametersFullError, match="no more than 9 subscriptions"):
        tree.subscribe("/a", "/good3", "http://good:3/")
    assert tree.count_subscriptions() == 9
    tree.unsubscribe_node("/n0", "http://bad:1/0")
    tree.subscribe("/a", "/good3", "http://good:3/")


def test_small_values_find_room_where_large_ones_have_filled_it() -> None:
    tree = ParameterTree(most=4 * MIB, reserve=MIB)
    for number in range(2):
        tree.set(f"/p{number}", "x" * MIB, "", MIB + 49)
    with pytest.raises(ParametersFullError, match="full: no more than 3 MiB"):
        finish(tree.make_room(MIB))
    for _ in range(5):
        weight = finish(weigh_in_steps("/robot_description", "x" * 200_000))
        assert tree.has_room(weight)
        tree.set("/robot_description", "x" * 200_000, "", weight)


def test_namespaces_count_their_memory() -> None:
    tree = ParameterTree()
    tracemalloc.start()
    try:
        for number in range(500):
            key = f"/{number}" + "/a" * 50
            tree.set(key, 1, "", finish(weigh_in_steps(key, 1)))
        taken = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert 0.5 * taken < tree._bytes < 2.5 * taken


@pytest.mark.parametrize(
    ("key", "value", "why"),
    [
        ("/a", 2**31, "does not fit"),
        ("/a", [[2**40]], "does not fit"),
        ("/a" * 40, {"a": {"b": [[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]}}, "nested deeper than 56"),
        ("/", [1], "cannot set root"),
    ],
)
def test_a_value_that_no_answer_holds_is_refused(key: str, value: Any, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        finish(weigh_in_steps(key, value))


@pytest.mark.parametrize(
    "value",
    [
        list(range(50_000)),
        [[number] for number in range(50_000)],
        [[0] * 900 for _ in range(60)],
        {f"k{number}": number for number in range(50_000)},
        {f"k{number}": {"a": 1} for number in range(25_000)},
    ],
)
def test_a_large_value_is_weighed_in_many_steps(value: Any) -> None:
    taken = sum(1 for _ in weigh_in_steps("/p", value))
    assert finish(weigh_in_steps("/p", value)) > 50_000 * 8
    assert taken >= 40


def test_limits_are_as_documented() -> None:
    assert (parameters.MAX_BYTES, parameters.RESERVE, parameters.SMALL) == (96 * 2**20, 16 * 2**20, 2**18)
    assert (parameters.MAX_SUBSCRIPTIONS, parameters.MAX_OF_ONE) == (20_000, 10_000)
    assert (parameters.FEW_RESERVE, parameters.FEW) == (5_000, 100)


@pytest.mark.parametrize(
    ("value", "weight"),
    [
        (1, 40),
        (-(2**31), 40),
        (2**31 - 1, 40),
        ("abc", getsizeof("abc")),
        (0.5, getsizeof(0.5)),
        ([], 70),
        ([1, [2, 3]], 2 * (70 + 16) + 3 * 40),
        ({}, 120),
        ({"ab": 1, "c": [2]}, 3 * 120 + getsizeof("ab") + getsizeof("c") + 40 + 78 + 40),
        ([1] * 1000, 70 + 8000 + 40_000),
        ({f"{number:03}": 1 for number in range(999)}, 120_000 + 999 * (getsizeof("abc") + 40)),
        ({f"{number:03}": 1 for number in range(1000)}, 120_120 + 1000 * (getsizeof("abc") + 40)),
    ],
)
def test_weight_of_a_value_is_about_its_memory(value: Any, weight: int) -> None:
    assert finish(weigh_in_steps("/p", value)) == weight


def test_parameter_may_be_56_levels_deep_and_is_counted_again() -> None:
    tree = ParameterTree(most=20_000)
    value: Any = 1
    for _ in range(54):
        value = [value]
    weight = finish(weigh_in_steps("/a/b", value))
    tree.set("/a/b", value, "", weight)
    for _ in range(5):
        finish(tree.make_room(weight))
        tree.set("/a/b", value, "", weight)
    for deeper in ([value], {"c": value}):
        with pytest.raises(ValueError, match="a parameter is nested deeper than 56 levels"):
            finish(weigh_in_steps("/a/b", deeper))


def test_room_shrinks_by_each_parameter_and_its_name() -> None:
    tree = ParameterTree(most=1000)
    assert tree.has_room(1000)
    assert not tree.has_room(1001)
    tree.set("/ab", 1, "", 40)
    left = 1000 - 40 - 3 - 120
    assert tree.has_room(left)
    assert not tree.has_room(left + 1)


def test_namespace_is_copied_once_after_it_was_returned() -> None:
    # Copying a large value at each change would be slow.
    tree = tree_of(a={"x": 1})
    for _ in range(2):
        returned = tree.get("/a")
        tree.set("/a/x", 2, "")
        own = tree._find(["a"])
        assert own is not returned
        tree.set("/a/y", 3, "")
        tree.delete("/a/y")
        assert tree._find(["a"]) is own


def test_small_tree_is_one_of_less_than_50_kb() -> None:
    tree = ParameterTree()
    tree.set("/p", 1, "", 49_999 - 2 - 120)
    assert tree.is_small
    tree.set("/p", 1, "", 1)
    assert not tree.is_small


def test_search_starts_in_any_namespace() -> None:
    tree = tree_of(p=1, X={"p": 2}, boxX={"p": 3})
    for namespace, found in (
        ("/", "/p"),
        ("/X", "/X/p"),
        ("/X/", "/X/p"),
        ("/boxX/deep", "/boxX/p"),
        ("/box", "/p"),
    ):
        assert tree.search(namespace, "p") == found


def test_names_come_in_the_order_of_the_tree() -> None:
    tree = tree_of(a={"b": 1, "c": {"d": 2}, "e": 3}, f=4, g={})
    assert tree.names() == ["/a/b", "/a/c/d", "/a/e", "/f"]


def test_names_are_in_no_cycle_of_references() -> None:
    # The master's garbage collector skips old objects, so a list in a reference cycle would never be freed.
    names = tree_of(a={"b": 1}).names()
    assert [each for each in gc.get_referrers(names) if isinstance(each, CellType)] == []


def test_names_of_a_large_tree_come_in_steps() -> None:
    tree = tree_of(a={f"k{number}": number for number in range(10_000)})
    steps = tree.names_in_steps()
    assert sum(1 for _ in steps) >= 10
    assert len(tree.names()) == 10_000
