"""The Slave API of a node: what the master and other nodes may ask it over XML-RPC.

Source: http://wiki.ros.org/ROS/Slave_API. The answers are ``[status code, text, value]``.
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
from minirospy.runtime.transport.local import PROTOCOL

if TYPE_CHECKING:
    from minirospy.base.environment import Environment
    from minirospy.runtime.node.topics import InLink, Publication, Subscription
    from minirospy.runtime.transport.links import OutLink

__all__ = ["SlaveApi", "connection_text"]

_BUMPED = re.compile(r"\[(/.*)\] Reason: new node registered with same name")
"""What masters write, rosmaster and ours."""


class ServedNode(Protocol):
    """The part of a node that the Slave API uses."""

    environment: Environment
    name: str
    this_host: str
    parameters: set[str]
    publications: dict[str, Publication]
    subscriptions: dict[str, Subscription]

    @property
    def uri(self) -> str:
        """The URI of its Slave API."""

    @property
    def tcpros_port(self) -> int:
        """The port of its topics and services."""

    @property
    def unix_name(self) -> str:
        """The name of its Unix socket."""

    def parameter_changed(self, key: str, value: object) -> None:
        """Take the new value of a parameter."""

    def publishers_changed(self, topic: str, publishers: list[str]) -> object:
        """Take the full list of a topic's publishers."""

    def request_shutdown(self, reason: str) -> None:
        """Begin to shut the node down."""


class SlaveApi:
    """One method per call of the API; ``dispatch`` is what the XML-RPC server calls (on the loop).

    Those that only tell may be called from any thread.
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
        """Return the answer to one call, or the steps that lead to it. Raise RpcFault on an unknown method."""
        return self.dispatcher.dispatch(method, args)

    def get_bus_stats(self, caller_id: str) -> Answer:
        """Transferred bytes and messages, by topic and connection."""
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
                # How many were lost on the way, nobody knows: -1.
                [[link.number, link.received_bytes, link.received, -1, True] for link in subscription.links],
            ]
            for subscription in list(self._node.subscriptions.values())
        ]
        return [SUCCESS, "", [publications, subscriptions, []]]

    def get_bus_info(self, caller_id: str) -> Answer:
        """One row a connection: [id, other end, direction, transport, topic, connected, what]."""
        rows: list[list[object]] = []
        for publication in list(self._node.publications.values()):
            for out in publication.links:
                what = connection_text(out)
                rows.append([out.number, out.peer, "o", out.transport, publication.topic, True, what])
        for subscription in list(self._node.subscriptions.values()):
            for link in subscription.links:
                what = connection_text(link)
                rows.append([link.number, link.uri, "i", link.transport, subscription.topic, True, what])
        return [SUCCESS, "bus info", rows]

    def get_master_uri(self, caller_id: str) -> Answer:
        """Return the master that this node registered with."""
        return [SUCCESS, self._node.environment.master_uri, self._node.environment.master_uri]

    def get_name(self, caller_id: str) -> Answer:
        """Return this node's name."""
        return [SUCCESS, "", self._node.name]

    def get_uri(self, caller_id: str) -> Answer:
        """Where this API is served."""
        return [SUCCESS, "", self._node.uri]

    def get_pid(self, caller_id: str) -> Answer:
        """Return this process's id."""
        return [SUCCESS, "", os.getpid()]

    def get_publications(self, caller_id: str) -> Answer:
        """[topic, type] of each topic that this node publishes."""
        rows = [[p.topic, p.type.name] for p in list(self._node.publications.values())]
        return [SUCCESS, "publications", rows]

    def get_subscriptions(self, caller_id: str) -> Answer:
        """[topic, type] of each topic that this node subscribes to."""
        rows = [[s.topic, s.type.name] for s in list(self._node.subscriptions.values())]
        return [SUCCESS, "subscriptions", rows]

    def param_update(self, caller_id: str, key: str, value: object) -> Answer:
        """Accept a new value of a parameter that this node subscribed to, of its namespace, or of what is below it."""
        self._node.parameter_changed(key, value)
        changed = names.canonicalize(key).rstrip("/") + "/"
        known = (f"{each.rstrip('/')}/" for each in list(self._node.parameters))
        if not any(each.startswith(changed) or changed.startswith(each) for each in known):
            return [ERROR, "not subscribed", 0]
        return [SUCCESS, "", 0]

    def publisher_update(self, caller_id: str, topic: str, publishers: list[str]) -> Answer:
        """Accept the master's full list of a topic's publishers."""
        self._node.publishers_changed(topic, publishers)
        return [SUCCESS, "", 0]

    def request_topic(self, caller_id: str, topic: str, protocols: object) -> Answer:
        """Where a subscriber finds the topic, by the first protocol that both sides speak."""
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
        """Stop the node.

        A master that bumps a node, since a new one of its name has registered, calls the address of the old one, which may
        have gone long ago and its port to this node: the reason names the node that is meant.
        """
        meant = _BUMPED.fullmatch(reason) if caller_id == "/master" and isinstance(reason, str) else None
        if meant and meant[1] != self._node.name:
            return [ERROR, f"this is {self._node.name}", 0]
        self._node.request_shutdown(f"external shutdown request from [{caller_id}]: [{reason}]")
        return [SUCCESS, "shutdown", 0]


def _refusal_before_tcpros(protocols: object) -> Answer | None:
    """Return rospy's answer to a list without TCPROS, or with an entry before it that is not a protocol; None for others."""
    if not isinstance(protocols, (list, dict, str)):
        kind = type(protocols).__name__
        return [ERROR, f"Error: invalid arguments: {kind!r} object is not iterable", []]

    for entry in protocols:
        if not isinstance(entry, (list, dict, str)):
            kind = type(entry).__name__
            return [ERROR, f"Error: invalid arguments: {kind!r} object is not subscriptable", []]
        if isinstance(entry, dict):
            # Keys of XML-RPC are texts: none is rospy's number 0.
            return [FAILURE, "Internal failure: 0", []]
        if not entry:
            kind = "list" if isinstance(entry, list) else "string"
            return [FAILURE, f"Internal failure: {kind} index out of range", []]
        if entry[0] == "TCPROS":
            return None
    return [FAILURE, "no supported protocol implementations", []]


def connection_text(link: InLink | OutLink) -> str:
    """Return a connection's text, of which `rosnode info` shows the numbers; none of a Unix socket, without a port."""
    on = f" on port {link.local_port}" if link.transport == "TCPROS" else ""
    return f"{link.transport} connection{on} to [{link.address} on socket {link.number}]"
