"""The Slave API of a node: what the master and other nodes may ask it over XML-RPC.

Source: http://wiki.ros.org/ROS/Slave_API. The answers are ``[status code, text, value]``.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from minirospy.errors import RpcFault
from minirospy.runtime.local import PROTOCOL
from minirospy.steps import Steps

if TYPE_CHECKING:
    from minirospy.runtime.links import OutLink
    from minirospy.runtime.node import Node
    from minirospy.runtime.topics import InLink

__all__ = ["SlaveApi"]

_SUCCESS, _FAILURE, _ERROR = 1, 0, -1


class _Refusal(Exception):
    """An argument is not acceptable; the text is the answer's."""


class SlaveApi:
    """One method per call of the API; ``dispatch`` is what the XML-RPC server calls (on the loop).

    Those that only tell may be called from any thread.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._methods: dict[str, tuple[Callable[..., list[Any]], Any]] = {
            # Name on the wire -> (method, the value of an answer that refuses).
            "getBusStats": (self.get_bus_stats, []),
            "getBusInfo": (self.get_bus_info, []),
            "getMasterUri": (self.get_master_uri, ""),
            "getName": (self.get_name, ""),
            "getPid": (self.get_pid, -1),
            "getPublications": (self.get_publications, []),
            "getSubscriptions": (self.get_subscriptions, []),
            "getUri": (self.get_uri, ""),
            "paramUpdate": (self.param_update, -1),
            "publisherUpdate": (self.publisher_update, -1),
            "requestTopic": (self.request_topic, []),
            "shutdown": (self.shutdown, 0),
        }

    def dispatch(self, method: str, args: Sequence[Any]) -> Any:
        """The answer to one call. Raises RpcFault on a method that is not there."""
        if method == "system.listMethods":
            return sorted(self._methods)
        if method == "system.multicall":
            # A list of structs in, a list of one-element lists (or fault structs) out.
            return self._call_many(args[0] if args and isinstance(args[0], list) else [])
        entry = self._methods.get(method)
        if entry is None:
            raise RpcFault(1, f'method "{method}" is not supported')
        function, refused = entry
        if not args:
            return [_ERROR, "missing required caller_id parameter", refused]
        if not isinstance(args[0], str):
            return [_ERROR, "caller_id must be a string", refused]
        most = function.__code__.co_argcount - 1
        if not most - len(function.__defaults__ or ()) <= len(args) <= most:
            return [_ERROR, "Error: bad call arity", refused]
        try:
            return function(*args)
        except _Refusal as refusal:
            return [_ERROR, str(refusal), refused]

    def get_bus_stats(self, caller_id: str) -> list[Any]:
        """Transferred bytes and messages, by topic and connection."""
        publications = [
            [
                publication.topic,
                sum(link.sent_bytes for link in publication.links),
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
        return [_SUCCESS, "", [publications, subscriptions, []]]

    def get_bus_info(self, caller_id: str) -> list[Any]:
        """One row a connection: [id, other end, direction, transport, topic, connected, what]."""
        rows: list[list[Any]] = []
        port = self._node.tcpros_port
        for publication in list(self._node.publications.values()):
            for out in publication.links:
                what = _connection_text(out, port)
                rows.append([out.number, out.peer, "o", out.transport, publication.topic, True, what])
        for subscription in list(self._node.subscriptions.values()):
            for link in subscription.links:
                what = _connection_text(link, link.local_port)
                rows.append([link.number, link.uri, "i", link.transport, subscription.topic, True, what])
        return [_SUCCESS, "bus info", rows]

    def get_master_uri(self, caller_id: str) -> list[Any]:
        """The master that this node registered with."""
        return [_SUCCESS, self._node.environment.master_uri, self._node.environment.master_uri]

    def get_name(self, caller_id: str) -> list[Any]:
        """This node's name."""
        return [_SUCCESS, "", self._node.name]

    def get_uri(self, caller_id: str) -> list[Any]:
        """Where this API is served."""
        return [_SUCCESS, "", self._node.uri]

    def get_pid(self, caller_id: str) -> list[Any]:
        """This process's id."""
        return [_SUCCESS, "", os.getpid()]

    def get_publications(self, caller_id: str) -> list[Any]:
        """[topic, type] of each topic that this node publishes."""
        rows = [[p.topic, p.type.name] for p in list(self._node.publications.values())]
        return [_SUCCESS, "publications", rows]

    def get_subscriptions(self, caller_id: str) -> list[Any]:
        """[topic, type] of each topic that this node subscribes to."""
        rows = [[s.topic, s.type.name] for s in list(self._node.subscriptions.values())]
        return [_SUCCESS, "subscriptions", rows]

    def param_update(self, caller_id: str, key: str, value: Any) -> list[Any]:
        """A parameter that this node subscribed to has changed."""
        self._node.parameter_changed(_text(key, "parameter_key"), value)
        return [_SUCCESS, "", 0]

    def publisher_update(self, caller_id: str, topic: str, publishers: Any) -> list[Any]:
        """The master's full list of a topic's publishers."""
        if not isinstance(publishers, list):
            raise _Refusal("ERROR: param [publishers] must be a list")
        if not all(isinstance(uri, str) for uri in publishers):
            raise _Refusal("ERROR: param [publishers] must be a list of strings")
        self._node.publishers_changed(_text(topic, "topic"), publishers)
        return [_SUCCESS, "", 0]

    def request_topic(self, caller_id: str, topic: str, protocols: Any) -> list[Any]:
        """Where a subscriber finds the topic, by the first protocol that both sides speak."""
        if not protocols:
            raise _Refusal("ERROR: parameter [protocols] must be specified and non-empty")
        if _text(topic, "topic") not in self._node.publications:
            return [_ERROR, f"Not a publisher of [{topic}]", []]
        offered = protocols if isinstance(protocols, list) else []
        host, port = self._node.environment.host, self._node.tcpros_port
        name = self._node.unix_name
        if name and [PROTOCOL, self._node.this_host] in offered:
            return [_SUCCESS, f"ready on {name}", [PROTOCOL, name, host, port]]
        if not any(isinstance(entry, list) and entry[:1] == ["TCPROS"] for entry in offered):
            return [_FAILURE, "no supported protocol implementations", []]
        return [_SUCCESS, f"ready on {host}:{port}", ["TCPROS", host, port]]

    def shutdown(self, caller_id: str, reason: str = "") -> list[Any]:
        """Stop the node."""
        self._node.request_shutdown(f"external shutdown request from [{caller_id}]: [{reason}]")
        return [_SUCCESS, "shutdown", 0]

    def _call_many(self, calls: list[Any]) -> Steps[list[Any]]:
        answers = []
        for call in calls:
            answers.append(self._one_of_many(call))
            yield None
        return answers

    def _one_of_many(self, call: Any) -> Any:
        try:
            return [self.dispatch(call["methodName"], call["params"])]
        except RpcFault as fault:
            return {"faultCode": fault.code, "faultString": fault.text}
        except (KeyError, TypeError):
            return {"faultCode": 1, "faultString": "a call is a struct of methodName and params"}


def _text(value: object, what: str) -> str:
    if not isinstance(value, str) or not value:
        raise _Refusal(f"ERROR: parameter [{what}] must be a non-empty string")
    return value


def _connection_text(link: InLink | OutLink, port: int) -> str:
    """A connection in the words of which `rosnode info` shows the numbers; of a Unix socket, which has no port, none."""
    on = f" on port {port}" if link.transport == "TCPROS" else ""
    return f"{link.transport} connection{on} to [{link.address} on socket {link.number}]"
