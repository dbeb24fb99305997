"""core/graph/registry: the tables without a server."""

from __future__ import annotations

from collections.abc import Callable
from sys import getsizeof, maxsize
from types import MethodType
from typing import Any

import pytest

from minirospy.core.graph import registry_limits, topic_types
from minirospy.core.graph.registry import NodeShutdown, PublisherUpdate, Registry, RegistryFullError
from minirospy.core.graph.shares import Shares
from minirospy.core.wire.journal import serialize_record


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
    assert list(registry.published_rows("/")) == [("/t", "a/B")]
    assert list(registry.published_rows("/x")) == []


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
    # The type is kept, as in rosmaster.
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
    monkeypatch.setattr(registry_limits, "MAX_ENTRIES", 3)
    registry = Registry()
    for number in range(3):
        registry.register_publisher("/n", f"/t{number}", "a/B", "u")
    with pytest.raises(RegistryFullError, match="3 topics, services and parameters of one node"):
        registry.register_publisher("/n", "/t3", "a/B", "u")
    # An existing registration may be repeated, and other nodes may register.
    registry.register_publisher("/n", "/t0", "a/B", "u")
    registry.register_publisher("/m", "/t3", "a/B", "um")
    assert "/t3" in registry.publishers()


def test_all_registrations_have_a_limit_in_memory_and_give_it_back() -> None:
    registry = Registry(Shares(100_000, 100_000, 0, 0))
    registered = fill(registry, "u")
    with pytest.raises(RegistryFullError) as refused:
        registry.register_publisher("/n", "/t", "a/B", "u")
    assert str(refused.value) == "the registration is beyond the limit of 0 MiB for all registrations"
    assert 40 < registered < 200
    # A long name uses more memory.
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
    assert registry.shares.total == 0


def test_limits_are_as_documented() -> None:
    shares = registry_limits.new_shares()
    assert (shares.most, shares.largest, shares.shared, shares.small) == (
        64 * 2**20,
        32 * 2**20,
        48 * 2**20,
        2**18,
    )
    assert registry_limits.MAX_ENTRIES == 10_000


def fill(registry: Registry, uri: str, prefix: str = "") -> int:
    """Register nodes at ``uri`` until a registration is refused; return their number."""
    for number in range(100_000):
        try:
            registry.register_publisher(f"/{prefix}n{number}", f"/{prefix}t{number}", "a/B", uri)
        except RegistryFullError:
            return number
    raise AssertionError("it is never full")


def register_node(registry: Registry, number: int) -> None:
    """Register a node as an ordinary program does, on a separate port."""
    uri = f"http://robot:{1000 + number}/"
    for topic in ("/rosout", f"/good{number}/out", "/status"):
        registry.register_publisher(f"/good{number}", topic, "std_msgs/String", uri)
    registry.register_subscriber(f"/good{number}", "/clock", "rosgraph_msgs/Clock", uri)
    registry.register_service(f"/good{number}", f"/good{number}/get", f"rosrpc://robot:{number}", uri)
    list(registry.register_parameter(f"/good{number}", "/watched", uri))


def test_ordinary_nodes_register_whatever_one_client_holds() -> None:
    registry = Registry(Shares(3_000_000, 2_000_000, 500_000, 10_000))
    # The names and the path in the URI may differ, because the port is the same.
    for number in range(10):
        fill(registry, f"http://127.0.0.1:9/{number}", f"bad{number}")
    with pytest.raises(RegistryFullError, match="1 MiB for the registrations of one host and port"):
        registry.register_publisher("/bad", "/bad", "a/B", "http://127.0.0.1:9/")
    for number in range(200):
        register_node(registry, number)


def test_ordinary_nodes_register_whatever_some_clients_hold() -> None:
    registry = Registry(Shares(3_000_000, 2_000_000, 500_000, 10_000))
    for port in range(5):
        fill(registry, f"http://127.0.0.1:{port}/", f"bad{port}")
    long_name = f"/{'x' * 10_000}"
    with pytest.raises(RegistryFullError, match="2 MiB for the registrations of all that have many"):
        registry.register_publisher(long_name, long_name, "a/B", "http://127.0.0.1:9/")
    for number in range(100):
        register_node(registry, number)


URI = "http://127.0.0.1:9/"
KINDS: dict[str, Callable[[Registry, int], object]] = {
    "topics of one node": lambda r, n: r.register_publisher("/n", f"/attack/{n}", "a/B", URI),
    "topics of many nodes": lambda r, n: r.register_publisher(f"/n{n}", f"/attack/{n}", "a/B", URI),
    "subscribers of one topic": lambda r, n: r.register_subscriber(f"/n{n}", "/fan", "a/B", URI + str(n)),
    "publishers of one topic": lambda r, n: r.register_publisher(f"/n{n}", "/fan", "a/B", URI + str(n)),
    "services of one node": lambda r, n: r.register_service("/n", f"/s{n}", f"rosrpc://x:{n}", URI),
    "long types": lambda r, n: r.register_publisher("/n", f"/t{n}", f"a/{n}" + "B" * 2000, URI),
    "long types of subscribers": lambda r, n: r.register_subscriber(
        "/n", f"/t{n}", f"a/{n}" + "B" * 2000, URI
    ),
    "long URIs of services": lambda r, n: r.register_service(
        "/n", f"/s{n}", f"rosrpc://{n}" + "x" * 2000, URI
    ),
    "long names": lambda r, n: r.register_publisher("/n" + "x" * 2000 + str(n), "/t", "a/B", URI),
    "topics that one publishes and subscribes to": lambda r, n: (
        r.register_publisher("/n", f"/attack/{n}", "a/B", URI),
        r.register_subscriber("/n", f"/attack/{n}", "a/B", URI),
    ),
}


def size_of(value: Any, seen: set[int]) -> int:
    """Return the memory of an object in bytes, including all objects to which it refers."""
    if id(value) in seen or isinstance(value, (type, MethodType)):
        return 0
    seen.add(id(value))
    inner: list[Any] = []
    if isinstance(value, dict):
        inner = [*value, *value.values()]
    elif isinstance(value, (list, tuple)):
        inner = list(value)
    elif hasattr(value, "__slots__"):
        inner = [getattr(value, name) for name in value.__slots__]
    elif hasattr(value, "__dict__"):
        inner = [value.__dict__]
    return getsizeof(value) + sum(size_of(each, seen) for each in inner)


@pytest.mark.parametrize("kind", KINDS)
def test_registrations_count_their_memory(kind: str) -> None:
    registry, count = Registry(), 2000
    for number in range(count):
        KINDS[kind](registry, number)
    taken = size_of(registry, set())
    # Sizes are counted for 64 bits; with 32 bits an object takes about half.
    most = 2.5 if maxsize > 2**32 else 5.0
    assert 0.8 * taken < registry.shares.total < most * taken


def test_a_registration_is_counted_until_the_last_of_it_is_gone() -> None:
    registry = Registry()

    def counted() -> int:
        return registry.shares.total

    registry.register_publisher("/n", "/t", "a/B", "u")
    one = counted()
    registry.register_subscriber("/n", "/t", "a/B", "u")
    registry.register_service("/n", "/t", "rosrpc://n:1", "u")
    list(registry.register_parameter("/n", "/t", "u"))
    more = counted()
    assert more > one
    # Repeat it, and use another service URI and another type with the same lengths.
    registry.register_publisher("/n", "/t", "a/C", "u")
    registry.register_subscriber("/n", "/t", "a/D", "u")
    registry.register_service("/n", "/t", "rosrpc://n:2", "u")
    list(registry.register_parameter("/n", "/t", "u"))
    assert counted() == more
    registry.unregister_subscriber("/n", "/t", "u")
    registry.unregister_service("/n", "/t", "rosrpc://n:2")
    registry.unregister_parameter("/n", "/t", "u")
    registry.unregister_parameter("/n", "/t", "u")
    assert counted() == one
    registry.unregister_publisher("/n", "/t", "u")
    assert counted() == 0


def test_a_type_is_counted_for_a_node_that_remains() -> None:
    registry = Registry()
    registry.register_subscriber("/s", "/t", "*", "http://s:1/")
    alone = registry.shares.total
    long_type = "a/" + "B" * 4000
    registry.register_publisher("/p", "/t", long_type, "http://p:1/")
    registry.unregister_publisher("/p", "/t", "http://p:1/")
    assert registry.shares.total - alone > 4000
    assert registry.shares.excess("s:1", registry.shares.largest - 4000)
    list(registry.forget("/s", "http://s:1/"))
    assert registry.shares.total == 0
    assert registry.topic_types() == {"/t": long_type}


def test_size_of_a_text_does_not_change_while_it_is_counted() -> None:
    registry = Registry()
    list(registry.register_parameter("/n", "/p", "http://n:1/"))
    before, text = registry.shares.total, "\u20ac" * 1000
    for number in range(3):
        uri = f"rosrpc://{text}:{number}"
        registry.register_service("/n", f"/s{text}", uri, "http://n:1/")
        registry.register_publisher("/n", f"/t{text}", f"a/{text}{number}", "http://n:1/")
        # Writing the journal makes Python create and cache a UTF-8 copy of each string.
        for row in (*registry.offers(), *registry.topic_types().items()):
            serialize_record(list(row))
    registry.unregister_service("/n", f"/s{text}", uri)
    registry.unregister_publisher("/n", f"/t{text}", "http://n:1/")
    assert registry.shares.total == before


def test_a_service_that_another_node_takes_over_is_counted_for_it() -> None:
    registry = Registry()
    registry.register_service("/a", "/s", "rosrpc://a:1" + "x" * 1000, "http://a:1/")
    registry.register_service("/b", "/s", "rosrpc://b:1", "http://b:1/")
    registry.unregister_service("/b", "/s", "rosrpc://b:1")
    assert registry.shares.total == 0


def test_topics_and_services_are_counted() -> None:
    registry = Registry()
    registry.register_publisher("/n", "/t", "a/B", "u")
    registry.register_subscriber("/n", "/t", "a/B", "u")
    registry.register_subscriber("/n", "/u", "a/B", "u")
    registry.register_service("/n", "/s", "rosrpc://n:1", "u")
    assert (registry.count_topics(), registry.count_services()) == (2, 1)


def test_as_many_old_types_are_remembered_as_may_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(topic_types, "MAX_OLD", 3)
    registry = Registry()
    registry.register_publisher("/n", "/published", "a/B", "u")
    registry.register_subscriber("/n", "/subscribed", "a/B", "u")
    for topic in ("/old1", "/old2", "/old3"):
        registry.set_type(topic, "a/B")
    assert len(registry.topic_types()) == 5
    registry.set_type("/old4", "a/B")
    assert list(registry.topic_types()) == ["/published", "/subscribed", "/old2", "/old3", "/old4"]
    # A topic whose node registers again is no longer counted as old.
    registry.register_publisher("/n", "/old2", "*", "u")
    registry.set_type("/old5", "a/B")
    assert registry.topic_types()["/old2"] == "a/B"
    assert len(registry.topic_types()) == 6


def test_old_types_take_no_more_than_4_mib() -> None:
    registry = Registry()
    for number in range(2000):
        registry.register_publisher("/n", f"/t{number}", f"a/{number}" + "B" * 4000, "u")
        registry.unregister_publisher("/n", f"/t{number}", "u")
    assert 900 < len(registry.topic_types()) < 1024


def test_types_of_topics_that_are_gone_are_forgotten_one_day(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(topic_types, "MAX_OLD", 10)
    registry = Registry()
    registry.register_publisher("/n", "/kept", "a/B", "u")
    for number in range(100):
        registry.register_publisher("/n", f"/t{number}", "a/B", "u")
        registry.unregister_publisher("/n", f"/t{number}", "u")
    types = registry.topic_types()
    assert len(types) == 11
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
