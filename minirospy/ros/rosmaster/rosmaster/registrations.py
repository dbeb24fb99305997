"""rosmaster.registrations: tables of nodes' registrations, for programs that implement a master.

A table maps a topic, service or parameter to the (name, API) of its nodes. Not thread-safe. Source of ``unregister``'s
responses: http://wiki.ros.org/ROS/Master_API.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, KeysView
from typing import Protocol
from xmlrpc.client import Error

from minirospy.ros.rosmaster.rosmaster.exceptions import InternalException
from minirospy.ros.rosmaster.rosmaster.util import remove_server_proxy, xmlrpcapi

__all__ = ["NodeRef", "RegistrationManager", "Registrations", "shutdown_node_task"]

Answer = tuple[int, str, int]


class Pool(Protocol):
    """The part of MarkedThreadPool that a RegistrationManager uses."""

    def queue_task(self, marker: object, task: Callable[..., object], args: tuple[object, ...]) -> object:
        """Call ``task(*args)`` in a thread, with at most one task at a time per marker."""


class Registrations:
    """A registration table: topic subscribers, topic publishers, services or parameter subscribers."""

    TOPIC_SUBSCRIPTIONS, TOPIC_PUBLICATIONS, SERVICE, PARAM_SUBSCRIPTIONS = 1, 2, 3, 4

    def __init__(self, type_: int) -> None:
        if type_ not in (1, 2, 3, 4):
            raise InternalException(f"invalid registration type: {type_}")
        self.type = type_
        self.map: dict[str, list[tuple[str, str | None]]] = {}
        self.service_api_map: dict[str, tuple[str, str]] | None = None

    def __bool__(self) -> bool:
        return bool(self.map)

    def __contains__(self, key: str) -> bool:
        return key in self.map

    def __getitem__(self, key: str) -> list[tuple[str, str | None]]:
        return self.map.get(key, [])

    def has_key(self, key: str) -> bool:
        """Return whether any node is registered for a name."""
        return key in self.map

    def iterkeys(self) -> KeysView[str]:
        """Return the registered names."""
        return self.map.keys()

    def get_apis(self, key: str) -> list[str | None]:
        """Return the APIs of the nodes registered for a name."""
        return [api for _, api in self[key]]

    def get_service_api(self, service: str) -> str | None:
        """Return a service's address, or None if the service is not registered."""
        return (self.service_api_map or {}).get(service, ("", None))[1]

    def get_state(self) -> list[list[object]]:
        """Return [name, [node, ...]] for each name, in the format of getSystemState."""
        return [[key, [name for name, _ in nodes]] for key, nodes in self.map.items()]

    def register(
        self, key: str, caller_id: str, caller_api: str | None, service_api: str | None = None
    ) -> None:
        """Register a node. A new service provider replaces the old one. Raise InternalException if a service has no address."""
        node = (caller_id, caller_api)
        nodes = self.map.get(key)
        if nodes is None or service_api:
            self.map[key] = [node]
        elif node not in nodes:
            nodes.append(node)

        if service_api:
            self.service_api_map = {**(self.service_api_map or {}), key: (caller_id, service_api)}
        else:
            self._require_no_service()

    def unregister_all(self, caller_id: str) -> None:
        """Remove all of a node's registrations."""
        kept = {key: [node for node in nodes if node[0] != caller_id] for key, nodes in self.map.items()}
        self.map = {key: nodes for key, nodes in kept.items() if nodes}
        if self.service_api_map:
            self.service_api_map = {
                key: pair for key, pair in self.service_api_map.items() if pair[0] != caller_id
            }

    def unregister(
        self, key: str, caller_id: str, caller_api: str | None, service_api: str | None = None
    ) -> Answer:
        """Unregister a node from a name; return the Master API's response with the number of removed nodes."""
        done = f"Unregistered [{caller_id}] as provider of [{key}]"
        if service_api:
            if self.service_api_map is None:
                return 1, f"[{caller_id}] is not a provider of [{key}]", 0
            if self.service_api_map.get(key) != (caller_id, service_api):
                return 1, f"[{service_api}] is no longer the current service api handle for [{key}]", 0
            del self.service_api_map[key], self.map[key]
            return 1, done, 1

        self._require_no_service()
        node = (caller_id, caller_api)
        if node not in self[key]:
            return 1, f"[{caller_id}] is not a known provider of [{key}]", 0
        self.map[key].remove(node)
        if not self.map[key]:
            del self.map[key]
        return 1, done, 1

    def _require_no_service(self) -> None:
        if self.type == Registrations.SERVICE:
            raise InternalException("service_api must be specified for Registrations.SERVICE")


class NodeRef:
    """A node's registrations."""

    def __init__(self, id: str, api: str) -> None:
        self.id = id
        self.api = api
        self.clear()

    def clear(self) -> None:
        """Remove all registrations but keep the node's name and API."""
        self.param_subscriptions: list[str] = []
        self.topic_subscriptions: list[str] = []
        self.topic_publications: list[str] = []
        self.services: list[str] = []

    def is_empty(self) -> bool:
        """Return whether the node has no registrations."""
        return not any(map(self._names, range(1, 5)))

    def add(self, type_: int, key: str) -> None:
        """Add a name to the table ``type_``. Raise InternalException if there is no such table."""
        if key not in (names := self._names(type_)):
            names.append(key)

    def remove(self, type_: int, key: str) -> None:
        """Remove a name from the table ``type_``. Raise InternalException if there is no such table."""
        if key in (names := self._names(type_)):
            names.remove(key)

    def _names(self, type_: int) -> list[str]:
        if type_ not in (1, 2, 3, 4):
            raise InternalException("internal bug")
        tables = (self.topic_subscriptions, self.topic_publications, self.services, self.param_subscriptions)
        return tables[type_ - 1]


def shutdown_node_task(api: str, caller_id: str, reason: str) -> None:
    """Ask a node to shut down. Ignore a node that does not respond, because it has probably exited."""
    with contextlib.suppress(OSError, Error):
        if node := xmlrpcapi(api):
            node.shutdown("/master", f"[{caller_id}] Reason: {reason}")
    remove_server_proxy(api)


class RegistrationManager:
    """A master's tables and nodes. If a node registers with a new API, the old node of that name is shut down."""

    def __init__(self, thread_pool: Pool) -> None:
        self.nodes: dict[str, NodeRef] = {}
        self.thread_pool = thread_pool
        self.publishers = Registrations(Registrations.TOPIC_PUBLICATIONS)
        self.subscribers = Registrations(Registrations.TOPIC_SUBSCRIPTIONS)
        self.services = Registrations(Registrations.SERVICE)
        self.param_subscribers = Registrations(Registrations.PARAM_SUBSCRIPTIONS)

    def get_node(self, caller_id: str) -> NodeRef | None:
        """Return a node, or None if it has no registrations."""
        return self.nodes.get(caller_id)

    def reverse_lookup(self, caller_api: str) -> list[NodeRef] | None:
        """Return the nodes with this API, or None if there are none."""
        return [node for node in self.nodes.values() if node.api == caller_api] or None

    def register_service(self, service: str, caller_id: str, caller_api: str, service_api: str) -> None:
        """Register a service."""
        self._register(self.services, service, caller_id, caller_api, service_api)

    def register_publisher(self, topic: str, caller_id: str, caller_api: str) -> None:
        """Register a publisher."""
        self._register(self.publishers, topic, caller_id, caller_api)

    def register_subscriber(self, topic: str, caller_id: str, caller_api: str) -> None:
        """Register a subscriber."""
        self._register(self.subscribers, topic, caller_id, caller_api)

    def register_param_subscriber(self, param: str, caller_id: str, caller_api: str) -> None:
        """Register a parameter subscriber."""
        self._register(self.param_subscribers, param, caller_id, caller_api)

    def unregister_service(self, service: str, caller_id: str, service_api: str) -> Answer:
        """Remove a service."""
        return self._unregister(self.services, service, caller_id, None, service_api)

    def unregister_publisher(self, topic: str, caller_id: str, caller_api: str) -> Answer:
        """Remove a publisher."""
        return self._unregister(self.publishers, topic, caller_id, caller_api)

    def unregister_subscriber(self, topic: str, caller_id: str, caller_api: str) -> Answer:
        """Remove a subscriber."""
        return self._unregister(self.subscribers, topic, caller_id, caller_api)

    def unregister_param_subscriber(self, param: str, caller_id: str, caller_api: str) -> Answer:
        """Remove a parameter subscriber."""
        return self._unregister(self.param_subscribers, param, caller_id, caller_api)

    def _register(
        self, table: Registrations, key: str, caller_id: str, api: str, service_api: str | None = None
    ) -> None:
        node = self.nodes.get(caller_id)
        if node is None or node.api != api:
            if node is not None:
                for each in (self.publishers, self.subscribers, self.services, self.param_subscribers):
                    each.unregister_all(caller_id)
                bumped = (node.api, caller_id, "new node registered with same name")
                self.thread_pool.queue_task(node.api, shutdown_node_task, bumped)
            node = self.nodes[caller_id] = NodeRef(caller_id, api)
        node.add(table.type, key)
        table.register(key, caller_id, api, service_api)

    def _unregister(
        self, table: Registrations, key: str, caller_id: str, api: str | None, service_api: str | None = None
    ) -> Answer:
        node = self.nodes.get(caller_id)
        if node is None:
            return 1, f"[{caller_id}] is not a registered node", 0
        answer = table.unregister(key, caller_id, api, service_api)
        if answer[2]:
            node.remove(table.type, key)
        if node.is_empty():
            del self.nodes[caller_id]
        return answer
