"""core/graph/subscription: which publishers to connect to, and when to reconnect."""

from __future__ import annotations

from minirospy.core.graph.subscription import MAX_PUBLISHERS, Connect, Disconnect, SubscriptionPlan


def test_new_publishers_are_connected_and_lost_ones_left() -> None:
    plan = SubscriptionPlan()
    assert plan.publishers_changed(["http://a", "http://b"]) == [Connect("http://a"), Connect("http://b")]
    assert plan.publishers_changed(["http://b", "http://c"]) == [Disconnect("http://a"), Connect("http://c")]
    assert plan.publishers_changed([]) == [Disconnect("http://b"), Disconnect("http://c")]


def test_a_list_of_too_many_publishers_is_cut() -> None:
    plan = SubscriptionPlan()
    uris = [f"http://{number}" for number in range(MAX_PUBLISHERS + 1)]
    connects = plan.publishers_changed(uris)
    assert [each.uri for each in connects] == uris[:-1]
    assert plan.publishers_changed(uris) == []


def test_many_new_publishers_are_not_connected_together() -> None:
    plan = SubscriptionPlan()
    delays = [
        each.delay for each in plan.publishers_changed(map(str, range(250))) if isinstance(each, Connect)
    ]
    assert delays == [0.0] * 100 + [0.01] * 100 + [0.02] * 50


def test_the_same_list_again_changes_nothing() -> None:
    plan = SubscriptionPlan()
    plan.publishers_changed(["http://a"])
    assert plan.publishers_changed(["http://a", "http://a"]) == []


def test_a_link_that_fails_is_tried_again_with_growing_pauses() -> None:
    plan = SubscriptionPlan()
    plan.publishers_changed(["http://a"])
    delays = [retry.delay for _ in range(9) if (retry := plan.lost("http://a"))]
    assert delays == sorted(delays)
    assert (delays[0], delays[1], delays[-1]) == (0.1, 0.2, 8.0)


def test_a_link_that_worked_starts_with_the_short_pause() -> None:
    plan = SubscriptionPlan()
    plan.publishers_changed(["http://a"])
    for _ in range(5):
        plan.lost("http://a")
    assert plan.failures("http://a") == 5
    plan.worked("http://a")
    assert plan.failures("http://a") == 0
    assert plan.lost("http://a") == Connect("http://a", 0.1)


def test_a_publisher_that_left_is_not_tried_again() -> None:
    plan = SubscriptionPlan()
    plan.publishers_changed(["http://a"])
    plan.publishers_changed([])
    assert plan.lost("http://a") is None


def test_events_of_a_publisher_that_left_are_ignored() -> None:
    plan = SubscriptionPlan()
    plan.worked("http://a")
    plan.refused("http://a")
    assert plan.failures("http://a") == 0
    assert plan.publishers_changed(["http://a"]) == [Connect("http://a")]


def test_refusing_publisher_is_retried_at_the_next_update() -> None:
    plan = SubscriptionPlan()
    plan.publishers_changed(["http://a", "http://b"])
    plan.refused("http://a")
    assert plan.publishers_changed(["http://a", "http://b"]) == [Connect("http://a")]
    assert plan.publishers_changed(["http://a", "http://b"]) == []


def test_incomplete_list_disconnects_no_publisher() -> None:
    plan = SubscriptionPlan()
    plan.publishers_changed(["http://a", "http://b"])
    assert plan.publishers_changed(["http://c"], keep=True) == [Connect("http://c")]
    assert plan.publishers_changed(["http://b"]) == [Disconnect("http://c"), Disconnect("http://a")]
