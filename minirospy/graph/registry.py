"""The master's registry: which nodes publish, subscribe and serve what.

Pure: calls in, (answer, actions) out. Names are global. Source: http://wiki.ros.org/ROS/Master_API, and real
rosmaster where that is silent.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

__all__ = ["Action", "NodeShutdown", "PublisherUpdate", "Registered", "Registry"]

_ANY = "*"


@dataclass(frozen=True)
class PublisherUpdate:
    """Tell the subscriber at ``uri`` the full list of a topic's publishers."""

    uri: str
    topic: str
    publishers: tuple[str, ...]


@dataclass(frozen=True)
class NodeShutdown:
    """Stop the node at ``uri``: another one has taken its name."""

    uri: str
    name: str
    reason: str


Action = PublisherUpdate | NodeShutdown


class Registered(NamedTuple):
    """The URIs of the other side (a publisher's subscribers, a subscriber's publishers), and what to do."""

    peers: list[str]
    actions: list[Action]


@dataclass
class _Node:
    uri: str
    publications: set[str] = field(default_factory=set)
    subscriptions: set[str] = field(default_factory=set)
    services: set[str] = field(default_factory=set)

    @property
    def is_empty(self) -> bool:
        return not (self.publications or self.subscriptions or self.services)


class _Service(NamedTuple):
    node: str
    uri: str


class Registry:
    """Who publishes, subscribes and serves what. Tables keep the order of registration."""

    def __init__(self) -> None:
        self._nodes: dict[str, _Node] = {}
        self._publishers: dict[str, dict[str, str]] = {}
        self._subscribers: dict[str, dict[str, str]] = {}
        self._services: dict[str, _Service] = {}
        self._types: dict[str, str] = {}

    # --- registering

    def register_publisher(self, node: str, topic: str, type_: str, uri: str) -> Registered:
        """``node``, whose Slave API is at ``uri``, publishes ``topic``."""
        actions = self._claim(node, uri)
        self._publishers.setdefault(topic, {})[node] = uri
        self._nodes[node].publications.add(topic)
        if type_ != _ANY or topic not in self._types:
            self._types[topic] = type_
        actions += self._tell_subscribers(topic)
        return Registered(list(self._subscribers.get(topic, {}).values()), actions)

    def unregister_publisher(self, node: str, topic: str, uri: str) -> Registered | None:
        """``node`` publishes ``topic`` no more; None where that was not registered from ``uri``."""
        if self._publishers.get(topic, {}).get(node) != uri:
            return None
        self._drop(self._publishers, topic, node)
        self._nodes[node].publications.discard(topic)
        self._forget_if_empty(node)
        return Registered([], list(self._tell_subscribers(topic)))

    def register_subscriber(self, node: str, topic: str, type_: str, uri: str) -> Registered:
        """``node`` subscribes to ``topic``; type "*" takes any and does not become the topic's."""
        actions = self._claim(node, uri)
        self._subscribers.setdefault(topic, {})[node] = uri
        self._nodes[node].subscriptions.add(topic)
        if type_ != _ANY:
            self._types.setdefault(topic, type_)
        return Registered(list(self._publishers.get(topic, {}).values()), actions)

    def unregister_subscriber(self, node: str, topic: str, uri: str) -> bool:
        """``node`` subscribes no more; whether that was registered from ``uri``."""
        if self._subscribers.get(topic, {}).get(node) != uri:
            return False
        self._drop(self._subscribers, topic, node)
        self._nodes[node].subscriptions.discard(topic)
        self._forget_if_empty(node)
        return True

    def register_service(self, node: str, service: str, service_uri: str, uri: str) -> list[Action]:
        """``node`` offers ``service`` at ``service_uri``; the last one to register has it."""
        actions = self._claim(node, uri)
        before = self._services.get(service)
        if before and before.node != node:
            self._nodes[before.node].services.discard(service)
            self._forget_if_empty(before.node)
        self._services[service] = _Service(node, service_uri)
        self._nodes[node].services.add(service)
        return actions

    def unregister_service(self, node: str, service: str, service_uri: str) -> bool:
        """``node`` offers ``service`` no more; whether it was offered at ``service_uri``."""
        if self._services.get(service) != _Service(node, service_uri):
            return False
        del self._services[service]
        self._nodes[node].services.discard(service)
        self._forget_if_empty(node)
        return True

    # --- asking

    def node_uri(self, node: str) -> str | None:
        """The URI of a node's Slave API."""
        entry = self._nodes.get(node)
        return entry.uri if entry else None

    def service_uri(self, service: str) -> str | None:
        """Where a service is called."""
        entry = self._services.get(service)
        return entry.uri if entry else None

    def topic_types(self) -> dict[str, str]:
        """The type of each topic that was ever registered with one."""
        return dict(self._types)

    def published_topics(self, subgraph: str = "") -> list[tuple[str, str]]:
        """(topic, type) of each published topic below the namespace ``subgraph``."""
        prefix = subgraph if not subgraph or subgraph.endswith("/") else subgraph + "/"
        return [
            (topic, self._types[topic])
            for topic in self._publishers
            if topic.startswith(prefix) and topic in self._types
        ]

    def publishers(self) -> dict[str, list[str]]:
        """Topic -> nodes that publish it."""
        return {topic: list(nodes) for topic, nodes in self._publishers.items()}

    def subscribers(self) -> dict[str, list[str]]:
        """Topic -> nodes that subscribe to it."""
        return {topic: list(nodes) for topic, nodes in self._subscribers.items()}

    def services(self) -> dict[str, list[str]]:
        """Service -> the node that offers it."""
        return {service: [entry.node] for service, entry in self._services.items()}

    # --- helpers

    def _claim(self, node: str, uri: str) -> list[Action]:
        """Make ``node`` known at ``uri``; what stood under its name at another address is dropped and stopped."""
        entry = self._nodes.get(node)
        if entry is None:
            self._nodes[node] = _Node(uri)
            return []
        if entry.uri == uri:
            return []
        changed = set(entry.publications)
        for topic in entry.publications:
            self._drop(self._publishers, topic, node)
        for topic in entry.subscriptions:
            self._drop(self._subscribers, topic, node)
        for service in entry.services:
            del self._services[service]
        self._nodes[node] = _Node(uri)
        actions: list[Action] = [NodeShutdown(entry.uri, node, "new node registered with same name")]
        for topic in sorted(changed):
            actions += self._tell_subscribers(topic)
        return actions

    def _tell_subscribers(self, topic: str) -> list[Action]:
        publishers = tuple(self._publishers.get(topic, {}).values())
        return [PublisherUpdate(uri, topic, publishers) for uri in self._subscribers.get(topic, {}).values()]

    def _drop(self, table: dict[str, dict[str, str]], topic: str, node: str) -> None:
        del table[topic][node]
        if not table[topic]:
            del table[topic]

    def _forget_if_empty(self, node: str) -> None:
        if self._nodes[node].is_empty:
            del self._nodes[node]
