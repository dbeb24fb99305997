"""graph/registry: the tables without a server."""

from __future__ import annotations

from sys import getsizeof

import pytest

from minirospy.graph import registry as registry_module
from minirospy.graph.registry import NodeShutdown, PublisherUpdate, Registry, RegistryFullError


def test_publishers_and_subscribers_find_each_other() -> None:
    registry = Registry()
    assert registry.register_subscriber("/s", "/t", "*", "us").peers == []
    peers, actions = registry.register_publisher("/p", "/t", "a/B", "up")
    assert peers == ["us"]
    assert list(actions) == [PublisherUpdate("us", "/t")]
    peers, actions = registry.register_subscriber("/s2", "/t", "a/B", "us2")
    assert peers == ["up"]
    assert list(actions) == []
    assert registry.publishers() == {"/t": ["/p"]}
    assert registry.subscribers() == {"/t": ["/s", "/s2"]}
    assert registry.publisher_uris("/t") == ["up"]
    assert registry.count_subscribers("/t") == 2
    assert registry.topic_types() == {"/t": "a/B"}
    assert registry.published_topics("/") == [("/t", "a/B")]
    assert registry.published_topics("/x") == []


def test_unregistering_needs_the_address_that_registered() -> None:
    registry = Registry()
    registry.register_subscriber("/s", "/t", "*", "us")
    registry.register_publisher("/p", "/t", "a/B", "up")
    assert registry.unregister_publisher("/p", "/t", "other") is None
    actions = registry.unregister_publisher("/p", "/t", "up")
    assert actions is not None
    assert list(actions) == [PublisherUpdate("us", "/t")]
    assert registry.unregister_publisher("/p", "/t", "up") is None
    assert not registry.unregister_subscriber("/s", "/t", "other")
    assert registry.unregister_subscriber("/s", "/t", "us")
    assert registry.nodes() == {}
    # The type stays, as in rosmaster.
    assert registry.topic_types() == {"/t": "a/B"}


def test_a_node_of_the_same_name_at_another_address_takes_over() -> None:
    registry = Registry()
    registry.register_subscriber("/s", "/old", "*", "us")
    registry.register_publisher("/n", "/old", "a/B", "u1")
    registry.register_service("/n", "/srv", "rosrpc://x:1", "u1")
    _, actions = registry.register_publisher("/n", "/new", "a/B", "u2")
    assert list(actions) == [
        NodeShutdown("u1", "/n", "new node registered with same name"),
        PublisherUpdate("us", "/old"),
    ]
    assert registry.publishers() == {"/new": ["/n"]}
    assert registry.services() == {}


def test_the_last_node_to_offer_a_service_has_it() -> None:
    registry = Registry()
    registry.register_service("/a", "/srv", "rosrpc://a:1", "ua")
    registry.register_service("/b", "/srv", "rosrpc://b:1", "ub")
    assert registry.service_uri("/srv") == "rosrpc://b:1"
    assert registry.nodes() == {"/b": "ub"}
    assert not registry.unregister_service("/a", "/srv", "rosrpc://a:1")
    assert registry.unregister_service("/b", "/srv", "rosrpc://b:1")
    assert registry.service_uri("/srv") is None


def test_a_forgotten_node_leaves_every_table() -> None:
    registry = Registry()
    registry.register_subscriber("/s", "/t", "*", "us")
    registry.register_publisher("/n", "/t", "a/B", "u")
    registry.register_subscriber("/n", "/x", "a/B", "u")
    registry.register_parameter("/n", "/p", "u")
    assert list(registry.forget("/n", "other")) == []
    assert list(registry.forget("/n", "u")) == [PublisherUpdate("us", "/t")]
    assert registry.nodes() == {"/s": "us"}
    assert registry.subscribers() == {"/t": ["/s"]}


def test_one_name_may_be_topic_service_and_parameter_of_a_node() -> None:
    registry = Registry()
    registry.register_publisher("/n", "/x", "a/B", "u")
    registry.register_subscriber("/n", "/x", "a/B", "u")
    registry.register_service("/n", "/x", "rosrpc://x:1", "u")
    registry.register_parameter("/n", "/x", "u")
    registry.unregister_publisher("/n", "/x", "u")
    registry.unregister_service("/n", "/x", "rosrpc://x:1")
    registry.unregister_parameter("/n", "/x", "u")
    assert registry.node_uri("/n") == "u"
    assert registry.subscriptions("/n") == ["/x"]
    registry.unregister_subscriber("/n", "/x", "u")
    assert registry.node_uri("/n") is None


# --- limits


def test_one_node_registers_so_much_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry_module, "MOST_ENTRIES", 3)
    registry = Registry()
    for number in range(3):
        registry.register_publisher("/n", f"/t{number}", "a/B", "u")
    with pytest.raises(RegistryFullError, match="3 topics, services and parameters of one node"):
        registry.register_publisher("/n", "/t3", "a/B", "u")
    # What is there may be registered again, and others may register.
    registry.register_publisher("/n", "/t0", "a/B", "u")
    registry.register_publisher("/m", "/t3", "a/B", "um")
    assert "/t3" in registry.publishers()


def test_all_registrations_have_a_limit_in_memory_and_give_it_back() -> None:
    registry = Registry(most_bytes=100_000)
    registered = 0

    while registered < 1000:
        try:
            registry.register_publisher(f"/n{registered}", f"/t{registered}", "a/B", "u")
        except RegistryFullError as error:
            refused = error
            break

        registered += 1

    assert refused.limit == "0 MiB for all registrations"
    assert str(refused) == "the registration is beyond the limit of 0 MiB for all registrations"
    assert 40 < registered < 200
    # A long name takes more.
    for number in range(registered):
        registry.unregister_publisher(f"/n{number}", f"/t{number}", "u")
    with pytest.raises(RegistryFullError):
        registry.register_publisher("/n" + "x" * 100_000, "/t", "a/B", "u")

    for _ in range(10):
        for number in range(registered):
            registry.register_publisher(f"/n{number}", f"/t{number}", "a/B", "u")
        for number in range(registered):
            list(registry.forget(f"/n{number}", "u"))

    assert registry.is_small


def test_limits_are_as_documented() -> None:
    assert (registry_module.MOST_BYTES, registry_module.MOST_ENTRIES) == (96 * 2**20, 10_000)


def test_registration_counts_once_whatever_it_is() -> None:
    registry = Registry()
    registry.register_publisher("/n", "/t", "a/B", "u")
    one = registry._bytes
    assert one == sum(map(getsizeof, ("/n", "u", "/t"))) + 1000
    registry.register_subscriber("/n", "/t", "a/B", "u")
    registry.register_service("/n", "/t", "rosrpc://n:1", "u")
    list(registry.register_parameter("/n", "/t", "u"))
    assert registry._bytes == one
    registry.unregister_subscriber("/n", "/t", "u")
    registry.unregister_service("/n", "/t", "rosrpc://n:1")
    registry.unregister_parameter("/n", "/t", "u")
    assert registry._bytes == one
    registry.register_publisher("/n", "/other", "a/B", "u")
    registry.unregister_publisher("/n", "/other", "u")
    assert registry._bytes == one
    registry.unregister_publisher("/n", "/t", "u")
    assert registry._bytes == 0


def test_topics_and_services_are_counted() -> None:
    registry = Registry()
    registry.register_publisher("/n", "/t", "a/B", "u")
    registry.register_subscriber("/n", "/t", "a/B", "u")
    registry.register_subscriber("/n", "/u", "a/B", "u")
    registry.register_service("/n", "/s", "rosrpc://n:1", "u")
    assert (registry.count_topics(), registry.count_services()) == (2, 1)


def test_as_many_old_types_are_remembered_as_may_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry_module, "_MOST_OLD_TYPES", 3)
    registry = Registry()
    registry.register_publisher("/n", "/published", "a/B", "u")
    registry.register_subscriber("/n", "/subscribed", "a/B", "u")
    for topic in ("/old1", "/old2", "/old3"):
        registry.set_type(topic, "a/B")
    assert len(registry.topic_types()) == 5
    registry.set_type("/old4", "a/B")
    assert set(registry.topic_types()) == {"/published", "/subscribed", "/old4"}


def test_types_of_topics_that_are_gone_are_forgotten_one_day(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry_module, "_MOST_OLD_TYPES", 10)
    registry = Registry()
    registry.register_publisher("/n", "/kept", "a/B", "u")
    for number in range(100):
        registry.register_publisher("/n", f"/t{number}", "a/B", "u")
        registry.unregister_publisher("/n", f"/t{number}", "u")
    types = registry.topic_types()
    assert len(types) <= 13
    assert types["/kept"] == "a/B"
    assert types["/t99"] == "a/B"


def test_actions_come_as_they_are_needed() -> None:
    registry = Registry()
    for number in range(1000):
        registry.register_subscriber(f"/s{number}", "/t", "*", f"u{number}")
    actions = iter(registry.register_publisher("/p", "/t", "a/B", "up").actions)
    assert next(actions) == PublisherUpdate("u0", "/t")
    registry.unregister_subscriber("/s1", "/t", "u1")
    assert sum(1 for _ in actions) == 999
