"""The master and the nodes as Python objects: typed calls, unwrapped responses, specific errors.

The calls block, and need no asyncio. Source: http://wiki.ros.org/ROS/Master_API, http://wiki.ros.org/ROS/Slave_API,
http://wiki.ros.org/ROS/Parameter%20Server%20API.
"""

from __future__ import annotations

import socket
from typing import Any, NamedTuple

from minirospy.base.environment import split_uri
from minirospy.base.errors import SUSPENDED, MasterUnreachableError, RpcRefused, RpcTimeout, RpcUnreachable
from minirospy.core.wire.large_messages import LargeMessages, parse_large_messages
from minirospy.runtime.rpc.client import RpcClient
from minirospy.runtime.transport.limits import is_file_limit

__all__ = ["BusConnection", "MasterProxy", "SlaveProxy", "SystemState", "master_unreachable", "unwrap"]


class SystemState(NamedTuple):
    """The publishers, subscribers and service providers, each as a dict from topic or service name to node names."""

    publishers: dict[str, list[str]]
    subscribers: dict[str, list[str]]
    services: dict[str, list[str]]


class BusConnection(NamedTuple):
    """One connection, as a node reports it.

    ``direction`` is "i", "o" or "b"; ``info`` and ``connected`` are set if the node reports them.
    """

    id: object
    destination: str
    direction: str
    transport: str
    topic: str
    connected: bool = True
    info: str = ""

    @property
    def true_transport(self) -> str:
        """Return the transport; UNIXROS for a Unix socket, which nodes report as TCPROS (docs/transports.md)."""
        return "UNIXROS" if str(self.info).startswith("UNIXROS ") else self.transport

    @property
    def large_messages(self) -> LargeMessages | None:
        """Return how the publisher sends large messages; None if it has sent none, or is not a minirospy node."""
        return parse_large_messages(str(self.info)) if "o" in str(self.direction) else None


def unwrap(method: str, answer: object) -> Any:
    """Return the value in a ROS API response. Raise RpcRefused if its status is not 1."""
    match answer:
        case [1, _, value]:
            return value
        case [int(code), text, *_]:
            raise RpcRefused(method, code, str(text))
        case _:
            raise RpcRefused(method, -1, f"answered {answer!r}")


def master_unreachable(error: RpcUnreachable) -> MasterUnreachableError:
    """Return the error for an unreachable master, with the cause if it is known."""
    cause = error.__cause__
    if isinstance(error, RpcTimeout):
        return MasterUnreachableError(error.uri, cause=f"{error.why}; {SUSPENDED}")
    if isinstance(cause, socket.gaierror):
        host = split_uri(error.uri)[0]
        why = f"the name [{host}] has no address here: set ROS_MASTER_URI to its IP address, or enter it in the hosts file"
        return MasterUnreachableError(error.uri, cause=why)
    return MasterUnreachableError(error.uri, error.why if is_file_limit(cause) else "")


class MasterProxy:
    """A proxy for the master at ``uri``. Calls are made as the node ``caller_id``.

    Each method raises MasterUnreachableError if the master does not respond, RpcRefused if it refuses the call.
    """

    def __init__(self, uri: str, caller_id: str, timeout: float = 5.0, *, same_host: bool = True) -> None:
        self.uri = uri
        self.caller_id = caller_id
        try:
            self._client = RpcClient(uri, timeout, same_host=same_host)
        except RpcUnreachable as error:
            raise MasterUnreachableError(uri) from error

    def call(self, method: str, *args: object) -> Any:
        """Call any API method; the caller's id is prepended to the arguments."""
        try:
            return unwrap(method, self._client.call(method, self.caller_id, *args))
        except RpcUnreachable as error:
            raise master_unreachable(error) from error

    def close(self) -> None:
        """Close the connections. Idempotent."""
        self._client.close()

    def is_online(self) -> bool:
        """Return whether the master responds."""
        try:
            self.get_pid()
        except MasterUnreachableError:
            return False
        return True

    def get_pid(self) -> int:
        """Return the master's process id."""
        return int(self.call("getPid"))

    def get_uri(self) -> str:
        """Return the URI that the master reports for itself."""
        return str(self.call("getUri"))

    def lookup_node(self, name: str) -> str:
        """Return the URI of a node's Slave API."""
        return str(self.call("lookupNode", name))

    def get_published_topics(self, subgraph: str = "") -> list[tuple[str, str]]:
        """Return (topic, type) for each published topic at or below ``subgraph``."""
        return [(topic, type_) for topic, type_ in self.call("getPublishedTopics", subgraph)]

    def get_topic_types(self) -> dict[str, str]:
        """Return a dict from topic to type, for the topics registered with the master."""
        return dict(self.call("getTopicTypes"))

    def get_system_state(self) -> SystemState:
        """Return publishers, subscribers and services."""
        return SystemState(*(dict(table) for table in self.call("getSystemState")))

    def lookup_service(self, name: str) -> str:
        """Return a service's URI (rosrpc://host:port)."""
        return str(self.call("lookupService", name))

    def register_publisher(self, topic: str, type_: str, caller_api: str) -> list[str]:
        """Register a publisher; return the URIs of the topic's subscribers."""
        return list(self.call("registerPublisher", topic, type_, caller_api))

    def unregister_publisher(self, topic: str, caller_api: str) -> int:
        """Unregister a publisher; return the number of registrations removed (0 or 1)."""
        return int(self.call("unregisterPublisher", topic, caller_api))

    def register_subscriber(self, topic: str, type_: str, caller_api: str) -> list[str]:
        """Register a subscriber; return the URIs of the topic's publishers."""
        return list(self.call("registerSubscriber", topic, type_, caller_api))

    def unregister_subscriber(self, topic: str, caller_api: str) -> int:
        """Unregister a subscriber; return the number of registrations removed (0 or 1)."""
        return int(self.call("unregisterSubscriber", topic, caller_api))

    def register_service(self, name: str, service_api: str, caller_api: str) -> None:
        """Register a service at ``service_api`` (rosrpc://host:port)."""
        self.call("registerService", name, service_api, caller_api)

    def unregister_service(self, name: str, service_api: str) -> int:
        """Unregister a service; return the number of registrations removed (0 or 1)."""
        return int(self.call("unregisterService", name, service_api))

    def get_param(self, key: str) -> Any:
        """Return a parameter's value, or the parameters below ``key`` as a dictionary."""
        return self.call("getParam", key)

    def set_param(self, key: str, value: object) -> None:
        """Set a parameter; a dictionary replaces the namespace ``key``."""
        self.call("setParam", key, value)

    def has_param(self, key: str) -> bool:
        """Return whether a parameter or namespace is set."""
        return bool(self.call("hasParam", key))

    def delete_param(self, key: str) -> None:
        """Delete a parameter or namespace."""
        self.call("deleteParam", key)

    def search_param(self, key: str) -> str | None:
        """Search for a parameter from the caller's namespace upwards; return the full name of the first match, or None."""
        try:
            return str(self.call("searchParam", key))
        except RpcRefused:
            return None

    def get_param_names(self) -> list[str]:
        """Return the names of all parameters."""
        return list(self.call("getParamNames"))

    def subscribe_param(self, caller_api: str, key: str) -> object:
        """Subscribe to changes at or below ``key``; return its current value."""
        return self.call("subscribeParam", caller_api, key)

    def unsubscribe_param(self, caller_api: str, key: str) -> int:
        """Unsubscribe from changes to ``key``."""
        return int(self.call("unsubscribeParam", caller_api, key))


class SlaveProxy:
    """A proxy for the node at ``uri``.

    Each method raises RpcUnreachable if the node does not respond, or another RpcError if the call fails.
    """

    def __init__(self, uri: str, caller_id: str, timeout: float = 3.0, *, same_host: bool = True) -> None:
        self.uri = uri
        self.caller_id = caller_id
        self._client = RpcClient(uri, timeout, same_host=same_host)

    def call(self, method: str, *args: object) -> Any:
        """Call any API method; the caller's id is prepended to the arguments."""
        return unwrap(method, self._client.call(method, self.caller_id, *args))

    def close(self) -> None:
        """Close the connections. Idempotent."""
        self._client.close()

    def get_pid(self) -> int:
        """Return the node's process id."""
        return int(self.call("getPid"))

    def get_bus_info(self) -> list[BusConnection]:
        """Return the node's connections."""
        return [BusConnection(*row[:7]) for row in self.call("getBusInfo")]

    def get_bus_stats(self) -> list[object]:
        """Return the statistics that the node reports."""
        return list(self.call("getBusStats"))

    def get_master_uri(self) -> str:
        """Return the URI of the master that the node registered with."""
        return str(self.call("getMasterUri"))

    def shutdown(self, reason: str = "") -> None:
        """Ask the node to shut down."""
        self.call("shutdown", reason)

    def get_subscriptions(self) -> list[tuple[str, str]]:
        """Return (topic, type) for each topic that the node subscribes to."""
        return [(topic, type_) for topic, type_ in self.call("getSubscriptions")]

    def get_publications(self) -> list[tuple[str, str]]:
        """Return (topic, type) for each topic that the node publishes."""
        return [(topic, type_) for topic, type_ in self.call("getPublications")]

    def request_topic(self, topic: str, protocols: list[list[object]]) -> list[object]:
        """Return the topic's address, as [protocol, host, port]."""
        return list(self.call("requestTopic", topic, protocols))
