"""The topics and services of this node, as rospy.impl.registration tells of them."""

from __future__ import annotations

from typing import Any

from minirospy.client.process import process
from minirospy.client.services import Service

__all__ = ["Registration", "ServiceManager", "TopicManager", "get_service_manager", "get_topic_manager"]


class Registration:
    """What a node registers with the master."""

    PUB = "pub"
    SUB = "sub"
    SRV = "srv"


class TopicManager:
    """Tells what this node publishes and subscribes to, and of its connections."""

    def get_publications(self) -> list[list[str]]:
        """[topic, type] of each topic that this node publishes."""
        return self._ask("get_publications")

    def get_subscriptions(self) -> list[list[str]]:
        """[topic, type] of each topic that this node subscribes to."""
        return self._ask("get_subscriptions")

    def get_topics(self) -> set[str]:
        """The names of all these."""
        return {topic for topic, _ in [*self.get_publications(), *self.get_subscriptions()]}

    def has_publication(self, resolved_name: str) -> bool:
        """Whether this node publishes a topic."""
        return any(topic == resolved_name for topic, _ in self.get_publications())

    def has_subscription(self, resolved_name: str) -> bool:
        """Whether this node subscribes to a topic."""
        return any(topic == resolved_name for topic, _ in self.get_subscriptions())

    def get_pub_sub_info(self) -> list[tuple[Any, ...]]:
        """A row each connection: (id, other end, direction, transport, topic, connected, what)."""
        return [tuple(row) for row in self._ask("get_bus_info")]

    def get_pub_sub_stats(self) -> tuple[list[Any], list[Any]]:
        """What getBusStats tells of publications and of subscriptions."""
        stats = self._ask("get_bus_stats")
        return (stats[0], stats[1]) if stats else ([], [])

    def _ask(self, method: str) -> list[Any]:
        if process.node is None:
            return []
        from minirospy.runtime.slave import SlaveApi

        return list(getattr(SlaveApi(process.node), method)(process.name)[2])


class ServiceManager:
    """Tells what services this node offers."""

    def get_services(self) -> list[tuple[str, Any]]:
        """The name and the URI of each."""
        return [(name, service.uri) for name, service in list(process.offered.items())]

    def get_service(self, resolved_service_name: str) -> Service[Any] | None:
        """The service of this name; None where this node does not offer it."""
        return process.offered.get(resolved_service_name)


def get_service_manager() -> ServiceManager:
    """The one of this process."""
    return ServiceManager()


def get_topic_manager() -> TopicManager:
    """The one of this process."""
    return TopicManager()
