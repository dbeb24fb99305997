"""This node's topics and services, with the interface of rospy.impl.registration."""

from __future__ import annotations

from typing import Any

from minirospy.client.service import Service
from minirospy.client.session import current_session

__all__ = ["Registration", "get_service_manager", "get_topic_manager"]


class Registration:
    """The kinds of registrations with the master."""

    PUB = "pub"
    SUB = "sub"
    SRV = "srv"


class TopicManager:
    """Lists the node's publications, subscriptions and connections."""

    def get_publications(self) -> list[list[str]]:
        """Return [topic, type] for each topic that this node publishes."""
        return self._query("get_publications")

    def get_subscriptions(self) -> list[list[str]]:
        """Return [topic, type] for each topic that this node subscribes to."""
        return self._query("get_subscriptions")

    def get_topics(self) -> set[str]:
        """Return the names of all topics that this node publishes or subscribes to."""
        return {topic for topic, _ in [*self.get_publications(), *self.get_subscriptions()]}

    def has_publication(self, resolved_name: str) -> bool:
        """Return whether this node publishes a topic."""
        return any(topic == resolved_name for topic, _ in self.get_publications())

    def has_subscription(self, resolved_name: str) -> bool:
        """Return whether this node subscribes to a topic."""
        return any(topic == resolved_name for topic, _ in self.get_subscriptions())

    def get_pub_sub_info(self) -> list[tuple[object, ...]]:
        """Return a row for each connection: (id, peer, direction, transport, topic, connected, description)."""
        return [tuple(row) for row in self._query("get_bus_info")]

    def get_pub_sub_stats(self) -> tuple[list[object], list[object]]:
        """Return the publication and subscription statistics, in the format of getBusStats."""
        stats = self._query("get_bus_stats")
        return (stats[0], stats[1]) if stats else ([], [])

    def _query(self, method: str) -> list[Any]:
        session = current_session()
        if session.node is None:
            return []
        from minirospy.runtime.node.slave import SlaveApi

        return list(getattr(SlaveApi(session.node), method)(session.name)[2])


class ServiceManager:
    """Lists this node's services."""

    def get_services(self) -> list[tuple[str, str | None]]:
        """Return each service's name and URI."""
        return [(name, service.uri) for name, service in list(current_session().offered.items())]

    def get_service(self, resolved_service_name: str) -> Service[object] | None:
        """Return the service with this name, or None if this node does not provide it."""
        return current_session().offered.get(resolved_service_name)


def get_service_manager() -> ServiceManager:
    """Return this process's service manager."""
    return ServiceManager()


def get_topic_manager() -> TopicManager:
    """Return this process's topic manager."""
    return TopicManager()
