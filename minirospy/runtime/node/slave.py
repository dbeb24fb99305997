"""A node's Slave API: the XML-RPC methods that the master and other nodes call.

Source: http://wiki.ros.org/ROS/Slave_API. The responses are ``[status code, message, value]``.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

from minirospy.base import names
from minirospy.core.graph.calls import (
    ERROR,
    FAILURE,
    SUCCESS,
    Answer,
    Dispatcher,
    Method,
    anything,
    global_key,
    global_name,
    parameters,
    some,
    uris,
)
from minirospy.core.wire.large_messages import LargeMessages
from minirospy.runtime.transport.local import PROTOCOL

if TYPE_CHECKING:
    from minirospy.base.environment import Environment
    from minirospy.runtime.node.publication import Publication
    from minirospy.runtime.node.subscription import InLink, Subscription
    from minirospy.runtime.transport.links import OutLink

__all__ = ["SlaveApi", "connection_text"]

# Matches the shutdown reason that rosmaster and minirospy's master send to a node whose name another node has taken over
_BUMPED = re.compile(r"\[(/.*)\] Reason: new node registered with same name")


class ServedNode(Protocol):
    """The interface to the node that the Slave API uses."""

    environment: Environment
    name: str
    this_host: str
    parameters: set[str]
    publications: dict[str, Publication]
    subscriptions: dict[str, Subscription]

    @property
    def uri(self) -> str:
        """The URI of the node's Slave API."""

    @property
    def tcpros_port(self) -> int:
        """The port of the node's topics and services."""

    @property
    def unix_name(self) -> str:
        """The name of the node's Unix socket."""

    def parameter_changed(self, key: str, value: object) -> None:
        """Apply a parameter's new value."""

    def publishers_changed(self, topic: str, publishers: list[str]) -> object:
        """Apply the complete list of a topic's publishers."""

    def request_shutdown(self, reason: str) -> None:
        """Start shutting the node down."""


class SlaveApi:
    """One method per API call; the XML-RPC server calls ``dispatch`` on the loop.

    Methods that only return data are thread-safe.
    """

    def __init__(self, node: ServedNode) -> None:
        self._node = node

        self.dispatcher = Dispatcher(
            {
                "getBusStats": Method(self.get_bus_stats, []),
                "getBusInfo": Method(self.get_bus_info, []),
                "getMasterUri": Method(self.get_master_uri, ""),
                "getName": Method(self.get_name, ""),
                "getPid": Method(self.get_pid, -1),
                "getPublications": Method(self.get_publications, []),
                "getSubscriptions": Method(self.get_subscriptions, []),
                "getUri": Method(self.get_uri, ""),
                "paramUpdate": Method(
                    self.param_update, -1, parameters(parameter_key=global_key, parameter_value=anything)
                ),
                "publisherUpdate": Method(
                    self.publisher_update, -1, parameters(topic=global_name, publishers=uris)
                ),
                "requestTopic": Method(self.request_topic, [], parameters(topic=global_name, protocols=some)),
                "shutdown": Method(self.shutdown, 0, parameters(msg=anything), optional=1),
            }
        )

    def dispatch(self, method: str, args: Sequence[object]) -> object:
        """Return the response to one call, or a generator that computes it in steps. Raise RpcFault if the method is unknown."""
        return self.dispatcher.dispatch(method, args)

    def get_bus_stats(self, caller_id: str) -> Answer:
        """Return the transferred bytes and messages, keyed by topic and connection."""
        publications = [
            [
                publication.topic,
                publication.sent_bytes,
                [[link.number, link.sent_bytes, link.sent, True] for link in publication.links],
            ]
            for publication in list(self._node.publications.values())
        ]
        subscriptions = [
            [
                subscription.topic,
                # The number of lost messages is unknown; report it as -1.
                [[link.number, link.received_bytes, link.received, -1, True] for link in subscription.links],
            ]
            for subscription in list(self._node.subscriptions.values())
        ]
        return [SUCCESS, "", [publications, subscriptions, []]]

    def get_bus_info(self, caller_id: str) -> Answer:
        """Return one row per connection: [id, peer, direction, transport, topic, connected, text].

        The transport is TCPROS also for a Unix socket, as programs expect: both carry the same frames. The text says which
        it is, and how the large messages are sent.
        """
        rows: list[list[object]] = []
        for publication in list(self._node.publications.values()):
            for out in publication.links:
                what = connection_text(out) + self._large_messages(out)
                rows.append([out.number, out.peer, "o", "TCPROS", publication.topic, True, what])
        for subscription in list(self._node.subscriptions.values()):
            for link in subscription.links:
                what = connection_text(link)
                rows.append([link.number, link.uri, "i", "TCPROS", subscription.topic, True, what])
        return [SUCCESS, "bus info", rows]

    def get_master_uri(self, caller_id: str) -> Answer:
        """Return the URI of the master that this node registered with."""
        return [SUCCESS, self._node.environment.master_uri, self._node.environment.master_uri]

    def get_name(self, caller_id: str) -> Answer:
        """Return this node's name."""
        return [SUCCESS, "", self._node.name]

    def get_uri(self, caller_id: str) -> Answer:
        """Return the URI of this API."""
        return [SUCCESS, "", self._node.uri]

    def get_pid(self, caller_id: str) -> Answer:
        """Return this process's id."""
        return [SUCCESS, "", os.getpid()]

    def get_publications(self, caller_id: str) -> Answer:
        """Return [topic, type] for each topic that this node publishes."""
        rows = [[p.topic, p.type.name] for p in list(self._node.publications.values())]
        return [SUCCESS, "publications", rows]

    def get_subscriptions(self, caller_id: str) -> Answer:
        """Return [topic, type] for each topic that this node subscribes to."""
        rows = [[s.topic, s.type.name] for s in list(self._node.subscriptions.values())]
        return [SUCCESS, "subscriptions", rows]

    def param_update(self, caller_id: str, key: str, value: object) -> Answer:
        """Accept a subscribed parameter's new value.

        The key may be the parameter itself, its namespace, or a parameter below it.
        """
        self._node.parameter_changed(key, value)
        changed = names.canonicalize(key).rstrip("/") + "/"
        known = (f"{each.rstrip('/')}/" for each in list(self._node.parameters))
        if not any(each.startswith(changed) or changed.startswith(each) for each in known):
            return [ERROR, "not subscribed", 0]
        return [SUCCESS, "", 0]

    def publisher_update(self, caller_id: str, topic: str, publishers: list[str]) -> Answer:
        """Accept the master's complete list of publishers for a topic."""
        self._node.publishers_changed(topic, publishers)
        return [SUCCESS, "", 0]

    def request_topic(self, caller_id: str, topic: str, protocols: object) -> Answer:
        """Return the topic's address: of the Unix socket if the subscriber can connect to it, otherwise for TCPROS."""
        if topic not in self._node.publications:
            return [ERROR, f"Not a publisher of [{topic}]", []]
        host, port = self._node.environment.host, self._node.tcpros_port
        name = self._node.unix_name
        if name and isinstance(protocols, list) and [PROTOCOL, self._node.this_host] in protocols:
            return [SUCCESS, f"ready on {name}", [PROTOCOL, name, host, port]]
        return _refusal_before_tcpros(protocols) or [
            SUCCESS,
            f"ready on {host}:{port}",
            ["TCPROS", host, port],
        ]

    def shutdown(self, caller_id: str, reason: str = "") -> Answer:
        """Shut the node down.

        When a new node with the same name registers, the master calls the old node's address. The old node may have
        exited long ago and this node may be using its port, so check that the reason contains this node's name.
        """
        meant = _BUMPED.fullmatch(reason) if caller_id == "/master" and isinstance(reason, str) else None
        if meant and meant[1] != self._node.name:
            return [ERROR, f"this is {self._node.name}", 0]
        self._node.request_shutdown(f"external shutdown request from [{caller_id}]: [{reason}]")
        return [SUCCESS, "shutdown", 0]

    def _large_messages(self, link: OutLink) -> str:
        """Return the last part of a connection's description: how its large messages are sent, or "" if there were none."""
        if not link.large:
            return ""
        chosen = self._node.environment.transport
        why = (
            f"MINIROSPY_TRANSPORT={chosen} for the publisher" if chosen in ("tcp", "unix") else link.obstacle
        )
        return LargeMessages(link.shared, link.large, why).text


def _refusal_before_tcpros(protocols: object) -> Answer | None:
    """Return rospy's error response if the list lacks TCPROS or has an invalid entry before it, else None."""
    if not isinstance(protocols, (list, dict, str)):
        kind = type(protocols).__name__
        return [ERROR, f"Error: invalid arguments: {kind!r} object is not iterable", []]

    for entry in protocols:
        if not isinstance(entry, (list, dict, str)):
            kind = type(entry).__name__
            return [ERROR, f"Error: invalid arguments: {kind!r} object is not subscriptable", []]
        if isinstance(entry, dict):
            # XML-RPC keys are strings, so rospy's look-up of the key 0 fails with this message.
            return [FAILURE, "Internal failure: 0", []]
        if not entry:
            kind = "list" if isinstance(entry, list) else "string"
            return [FAILURE, f"Internal failure: {kind} index out of range", []]
        if entry[0] == "TCPROS":
            return None
    return [FAILURE, "no supported protocol implementations", []]


def connection_text(link: InLink | OutLink) -> str:
    """Return a connection's description, from which `rosnode info` prints the ports. A Unix socket has no port."""
    on = f" on port {link.local_port}" if link.transport == "TCPROS" else ""
    return f"{link.transport} connection{on} to [{link.address} on socket {link.number}]"
