"""The master's registry: each node's publishers, subscribers and services.

Pure: calls return a response and the actions to perform. Names are global. Source: http://wiki.ros.org/ROS/Master_API,
and rosmaster for details missing there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from sys import intern
from typing import NamedTuple

from minirospy.core.graph import registry_limits
from minirospy.core.graph.registry_limits import (
    PARAMETER,
    PUBLISHES,
    SERVES,
    SUBSCRIBES,
    RegistryFullError,
    name_cost,
    node_cost,
    text_cost,
)
from minirospy.core.graph.shares import Shares, holder_of
from minirospy.core.graph.topic_types import TopicTypes

__all__ = ["Action", "NodeShutdown", "PublisherUpdate", "Registered", "Registry", "RegistryFullError"]

_ANY = "*"
_FEW_BYTES, _MANY_BYTES = 50_000, 2_000_000


class PublisherUpdate(NamedTuple):
    """A notification to the subscriber at ``uri`` with the complete list of a topic's publishers at the time of sending."""

    uri: str
    topic: str


class NodeShutdown(NamedTuple):
    """A request to the node at ``uri`` to shut down, because another node has registered with its name."""

    uri: str
    name: str
    reason: str


Action = PublisherUpdate | NodeShutdown


class Registered(NamedTuple):
    """The URIs of the peers (a publisher's subscribers, a subscriber's publishers), and the actions to perform."""

    peers: list[str]
    actions: Iterable[Action]


class _NodeEntry:
    """A node's name and URI, and its registrations: a dict from name to kinds of registration, as bits."""

    __slots__ = ("entries", "holder", "name", "size", "uri")

    def __init__(self, name: str, uri: str) -> None:
        self.name = name
        self.uri = uri
        self.holder = intern(holder_of(uri))
        self.size = 0  # bytes of memory counted for this node
        self.entries: dict[str, int] = {}

    def add(self, name: str, kind: int) -> None:
        self.entries[name] = self.entries.get(name, 0) | kind

    def discard(self, name: str, kind: int) -> None:
        left = self.entries.get(name, 0) & ~kind
        if left:
            self.entries[name] = left
        else:
            self.entries.pop(name, None)

    def names(self, kind: int) -> list[str]:
        return [name for name, kinds in self.entries.items() if kinds & kind]


class _Service(NamedTuple):
    node: str
    uri: str


class Registry:
    """The publishers, subscribers and services in a graph. Tables preserve the order of registration.

    Actions are yielded one by one, on demand, because there may be many.
    """

    def __init__(self, shares: Shares | None = None) -> None:
        """Create an empty registry; ``shares`` limits how many bytes the nodes on each host and port may use."""
        self.changes = 0  # increases whenever the publishers, subscribers or services may have changed
        self.shares = shares or registry_limits.new_shares()
        self._nodes: dict[str, _NodeEntry] = {}
        self._publishers: dict[str, dict[str, str]] = {}
        self._subscribers: dict[str, dict[str, str]] = {}
        self._services: dict[str, _Service] = {}
        self._types = TopicTypes(self._count_for)

    # --- registering

    def register_publisher(self, node: str, topic: str, type_: str, uri: str) -> Registered:
        """Register ``node``, whose Slave API is at ``uri``, as a publisher of ``topic``."""
        actions = self._claim(node, uri, topic, PUBLISHES, type_)
        entry = self._enter(node, topic, PUBLISHES)
        _row(self._publishers, topic)[entry.name] = entry.uri
        if type_ == _ANY:
            self._types.add(topic, type_, entry.name)
        else:
            self._types.set(topic, type_, entry.name)
        subscribers = self._subscribers.get(topic)
        if subscribers is None:
            return Registered([], actions)
        return Registered(list(subscribers.values()), chain(actions, self._updates(topic)))

    def unregister_publisher(self, node: str, topic: str, uri: str) -> Iterable[Action] | None:
        """Unregister a publisher of ``topic``. Return the updates to send, or None if it was not registered from ``uri``."""
        if self._publishers.get(topic, {}).get(node) != uri:
            return None
        self._drop(self._publishers, topic, node, PUBLISHES)
        return self._updates(topic)

    def register_subscriber(self, node: str, topic: str, type_: str, uri: str) -> Registered:
        """Register ``node`` as a subscriber to ``topic``.

        The type "*" matches any type, and is not stored as the topic's type.
        """
        actions = self._claim(node, uri, topic, SUBSCRIBES, type_)
        entry = self._enter(node, topic, SUBSCRIBES)
        _row(self._subscribers, topic)[entry.name] = entry.uri
        if type_ != _ANY or topic in self._types:
            self._types.add(topic, type_, entry.name)
        publishers = self._publishers.get(topic)
        return Registered(list(publishers.values()) if publishers else [], actions)

    def unregister_subscriber(self, node: str, topic: str, uri: str) -> bool:
        """Unregister ``node`` as a subscriber; return whether it was registered from ``uri``."""
        if self._subscribers.get(topic, {}).get(node) != uri:
            return False
        self._drop(self._subscribers, topic, node, SUBSCRIBES)
        return True

    def register_service(self, node: str, service: str, service_uri: str, uri: str) -> Iterable[Action]:
        """Register ``node`` as the provider of ``service``, at ``service_uri``. It replaces the previous provider."""
        actions = self._claim(node, uri, service, SERVES, service_uri)
        before = self._services.get(service)
        if before:
            self._count(self._nodes[before.node], -text_cost(before.uri))
            if before.node != node:
                self._leave(before.node, service, SERVES)
        entry = self._enter(node, service, SERVES)
        self._count(entry, text_cost(service_uri))
        self._services[service] = _Service(entry.name, service_uri)
        return actions

    def unregister_service(self, node: str, service: str, service_uri: str) -> bool:
        """Unregister ``node`` as the provider of ``service``; return whether it offered the service at ``service_uri``."""
        if self._services.get(service) != _Service(node, service_uri):
            return False
        del self._services[service]
        self._count(self._nodes[node], -text_cost(service_uri))
        self._leave(node, service, SERVES)
        return True

    def register_parameter(self, node: str, key: str, uri: str) -> Iterable[Action]:
        """Record that ``node`` has subscribed to a parameter; the subscription itself is in the parameter tree."""
        actions = self._claim(node, uri, key, PARAMETER)
        self._enter(node, key, PARAMETER)
        return actions

    def unregister_parameter(self, node: str, key: str, uri: str) -> None:
        """Remove the record of ``node``'s subscription to a parameter."""
        entry = self._nodes.get(node)
        if entry and entry.uri == uri:
            self._leave(node, key, PARAMETER)

    def forget(self, node: str, uri: str) -> Iterable[Action]:
        """Remove all registrations that ``node`` made from ``uri``, because the node no longer exists."""
        entry = self._nodes.get(node)
        if entry is None or entry.uri != uri:
            return ()
        published = self._clear(entry)
        return self._updates(*published)

    def set_type(self, topic: str, type_: str) -> None:
        """Set the type of a topic that currently has no registrations."""
        self._types.keep(topic, type_)

    # --- queries

    @property
    def is_small(self) -> bool:
        """Return whether all registrations together use little memory, less than ``_FEW_BYTES``."""
        return self.shares.total < _FEW_BYTES

    @property
    def is_large(self) -> bool:
        """Return whether a list of all registrations would use so much memory that only one should be built at a time."""
        return self.shares.total > _MANY_BYTES

    @property
    def is_crowded(self) -> bool:
        """Return whether little memory is left, apart from the part reserved for hosts and ports with few registrations."""
        return self.shares.total > self.shares.shared * 7 // 8

    def node_uri(self, node: str) -> str | None:
        """Return the URI of a node's Slave API."""
        entry = self._nodes.get(node)
        return entry.uri if entry else None

    def nodes(self) -> dict[str, str]:
        """Return a dict from each node to the URI of its Slave API."""
        return {name: entry.uri for name, entry in self._nodes.items()}

    def service_uri(self, service: str) -> str | None:
        """Return a service's URI."""
        entry = self._services.get(service)
        return entry.uri if entry else None

    def count_subscribers(self, topic: str) -> int:
        """Return the number of nodes that subscribe to a topic."""
        return len(self._subscribers.get(topic, ()))

    def publisher_uris(self, topic: str) -> list[str]:
        """Return the URIs of a topic's publishers."""
        return list(self._publishers.get(topic, {}).values())

    def subscriptions(self, node: str) -> list[str]:
        """Return the topics that a node subscribes to."""
        entry = self._nodes.get(node)
        return entry.names(SUBSCRIBES) if entry else []

    def topic_types(self) -> dict[str, str]:
        """Return the type of each topic that is registered, or was: see :class:`TopicTypes`."""
        return dict(self.type_rows())

    def publishers(self) -> dict[str, list[str]]:
        """Return the nodes that publish each topic."""
        return dict(self.publisher_rows())

    def subscribers(self) -> dict[str, list[str]]:
        """Return the nodes that subscribe to each topic."""
        return dict(self.subscriber_rows())

    def services(self) -> dict[str, list[str]]:
        """Return a dict from service to a list with the node that offers it."""
        return dict(self.service_rows())

    def type_rows(self) -> Iterator[tuple[str, str]]:
        """Yield the items of :meth:`topic_types`. The table may change during the iteration."""
        return self._types.rows()

    def published_rows(self, subgraph: str = "") -> Iterator[tuple[str, str]]:
        """Yield (topic, type) for each published topic below the namespace ``subgraph``. The table may change meanwhile."""
        prefix = subgraph if not subgraph or subgraph.endswith("/") else subgraph + "/"
        return (
            (topic, self._types[topic])
            for topic in list(self._publishers)
            if topic.startswith(prefix) and topic in self._types
        )

    def publisher_rows(self) -> Iterator[tuple[str, list[str]]]:
        """Yield each topic and the nodes that publish it. The table may change during the iteration."""
        return _rows(self._publishers)

    def subscriber_rows(self) -> Iterator[tuple[str, list[str]]]:
        """Yield each topic and the nodes that subscribe to it. The table may change during the iteration."""
        return _rows(self._subscribers)

    def service_rows(self) -> Iterator[tuple[str, list[str]]]:
        """Yield (service, [node that offers it]) for each service. The table may change during the iteration."""
        return ((service, [entry.node]) for service, entry in list(self._services.items()))

    def count_topics(self) -> int:
        """Return the number of topics that are published or subscribed to."""
        return len(self._publishers.keys() | self._subscribers.keys())

    def count_services(self) -> int:
        """Return the number of services."""
        return len(self._services)

    def publications(self) -> Iterator[tuple[str, str]]:
        """Yield (node, topic) for each publication, in table order. The tables may change during the iteration."""
        return _pairs(self._publishers)

    def all_subscriptions(self) -> Iterator[tuple[str, str]]:
        """Yield (node, topic) for each subscription. The table may change during the iteration."""
        return _pairs(self._subscribers)

    def offers(self) -> Iterator[tuple[str, str, str]]:
        """Yield (node, service, URI) for each service."""
        return ((entry.node, service, entry.uri) for service, entry in self._services.items())

    # --- helpers

    def _claim(self, node: str, uri: str, name: str, kind: int, text: str = "") -> Iterable[Action]:
        """Record that ``node`` at ``uri`` registers ``name`` with a type or a service URI.

        If the same node name is registered from another address, remove those registrations and stop the node there. Raise
        RegistryFullError if a limit is exceeded.
        """
        entry = self._nodes.get(node)
        is_new = entry is None or entry.uri != uri
        kinds = entry.entries.get(name, 0) if entry and not is_new else 0
        if entry and not is_new and not kinds and len(entry.entries) >= registry_limits.MAX_ENTRIES:
            most = registry_limits.MAX_ENTRIES
            raise RegistryFullError(f"{most} topics, services and parameters of one node")

        cost = node_cost(node, uri) if is_new else 0
        cost += name_cost(name, kind, kinds) + self._cost_of_text(name, kind, text)
        holder = entry.holder if entry and not is_new else holder_of(uri)
        excess = self.shares.excess(holder, cost) if cost > 0 else None
        if excess:
            raise RegistryFullError(registry_limits.describe(excess, self.shares))
        if not is_new:
            return ()

        published = self._clear(entry) if entry else []
        added = self._nodes[node] = _NodeEntry(node, uri)
        self._count(added, node_cost(node, uri))
        if entry is None:
            return ()
        shutdown = NodeShutdown(entry.uri, node, "new node registered with same name")
        return chain((shutdown,), self._updates(*published))

    def _cost_of_text(self, name: str, kind: int, text: str) -> int:
        """Return how many more bytes a type or service URI uses than the string that it replaces."""
        if kind == SERVES:
            service = self._services.get(name)
            return text_cost(text) - (text_cost(service.uri) if service else 0)
        return 0 if kind == PARAMETER else self._types.cost(name, text)

    def _count(self, entry: _NodeEntry, size: int) -> None:
        entry.size += size
        self.shares.add(entry.holder, size)

    def _count_for(self, node: str, size: int) -> None:
        self._count(self._nodes[node], size)

    def _clear(self, entry: _NodeEntry) -> list[str]:
        """Remove a node from every table; return the topics that it published."""
        self.changes += 1
        published = entry.names(PUBLISHES)
        for topic in published:
            _remove(self._publishers, topic, entry.name)
        for topic in entry.names(SUBSCRIBES):
            _remove(self._subscribers, topic, entry.name)
        for service in entry.names(SERVES):
            del self._services[service]
        for topic in entry.names(PUBLISHES | SUBSCRIBES):
            self._leave_type(topic, entry)
        del self._nodes[entry.name]
        self._count(entry, -entry.size)
        return published

    def _enter(self, node: str, name: str, kind: int) -> _NodeEntry:
        self.changes += 1
        entry = self._nodes[node]
        self._count(entry, name_cost(name, kind, entry.entries.get(name, 0)))
        entry.add(intern(name), kind)
        return entry

    def _leave(self, node: str, name: str, kind: int) -> None:
        self.changes += 1
        entry = self._nodes[node]
        if not entry.entries.get(name, 0) & kind:
            return
        entry.discard(name, kind)
        self._count(entry, -name_cost(name, kind, entry.entries.get(name, 0)))
        if kind in (PUBLISHES, SUBSCRIBES):
            self._leave_type(name, entry)
        if not entry.entries:
            del self._nodes[node]
            self._count(entry, -entry.size)

    def _drop(self, table: dict[str, dict[str, str]], topic: str, node: str, kind: int) -> None:
        _remove(table, topic, node)
        self._leave(node, topic, kind)

    def _leave_type(self, topic: str, entry: _NodeEntry) -> None:
        if self._types.is_counted_for(topic, entry.name):
            others = chain(self._publishers.get(topic, ()), self._subscribers.get(topic, ()))
            self._types.leave(topic, entry.name, others)

    def _updates(self, *topics: str) -> Iterator[Action]:
        """Yield an update for each subscriber of the topics, with the topic's publishers at that moment."""
        for topic in topics:
            for uri in list(self._subscribers.get(topic, {}).values()):
                yield PublisherUpdate(uri, topic)


def _rows(table: dict[str, dict[str, str]]) -> Iterator[tuple[str, list[str]]]:
    return ((topic, list(nodes)) for topic, nodes in list(table.items()) if nodes)


def _row(table: dict[str, dict[str, str]], topic: str) -> dict[str, str]:
    row = table.get(topic)
    if row is None:
        row = table[intern(topic)] = {}
    return row


def _remove(table: dict[str, dict[str, str]], topic: str, node: str) -> None:
    del table[topic][node]
    if not table[topic]:
        del table[topic]


def _pairs(table: dict[str, dict[str, str]]) -> Iterator[tuple[str, str]]:
    # This is the fastest way to copy many small tables, and every rewrite of a journal starts with this copy.
    rows = list(zip(table, map(tuple, table.values()), strict=True))
    return ((node, topic) for topic, nodes in rows for node in nodes)
