"""The graph to query: a master, and name resolution for the caller."""

from __future__ import annotations

import contextlib
import os
import re
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base import names
from minirospy.base.environment import master_and_namespace
from minirospy.base.errors import NotFoundError, RpcRefused
from minirospy.runtime.rpc.master_proxy import MasterProxy

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from minirospy.runtime.rpc.master_proxy import SystemState

__all__ = [
    "Graph",
    "NodeAddress",
    "in_namespace",
    "node_host",
    "unknown_service",
    "unknown_topic",
    "why_illegal",
]

_MAX_NAME_LENGTH = 4096  # maximum length of a name; the master rejects longer ones


class NodeAddress(NamedTuple):
    """A node's name and the URI of its Slave API, which is None if the master does not know the node."""

    name: str
    uri: str | None


class Graph:
    """A master's graph, queried with caller_id ``tool``. Resolves names in ``namespace``, then remaps them.

    A context manager. Every call raises MasterUnreachableError if no master responds.
    """

    def __init__(
        self,
        master: MasterProxy,
        tool: str,
        namespace: str = "/",
        remappings: Mapping[str, str] | None = None,
    ) -> None:
        self.master = master
        self.tool = tool
        self._node_name = namespace.rstrip("/") + "/" + tool
        self._remappings = {
            names.resolve(name, self._node_name): names.resolve(to, self._node_name)
            for name, to in (remappings or {}).items()
        }
        self._uris: dict[str, str | None] = {}

    @classmethod
    def open(
        cls, tool: str, environ: Mapping[str, str] | None = None, arguments: names.Arguments | None = None
    ) -> Graph:
        """Return the graph for an environment and, if ``arguments`` are given, the command line's remappings.

        Raise UsageError if ROS_MASTER_URI is invalid.
        """
        given = arguments or names.parse_arguments(())
        master_uri, namespace = master_and_namespace(
            os.environ if environ is None else environ,
            master_uri=given.special.get("__master", ""),
            namespace=given.special.get("__ns", ""),
        )
        return cls(MasterProxy(master_uri, "/" + tool), tool, namespace, given.remappings)

    def __enter__(self) -> Graph:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection to the master. Idempotent."""
        self.master.close()

    def resolve(self, name: str) -> str:
        """Return the global name that ``name`` resolves to."""
        return names.resolve(name, self._node_name, self._remappings)

    def state(self) -> SystemState:
        """Return the publishers, subscribers and services of all nodes."""
        return self.master.get_system_state()

    def node_uri(self, node: str) -> str | None:
        """Return the URI of a node's Slave API from the master, or None if the master does not know the node."""
        if node not in self._uris:
            uri: str | None = None
            with contextlib.suppress(RpcRefused):
                uri = self.master.lookup_node(node)
            self._uris[node] = uri
        return self._uris[node]

    def addresses(self, nodes: Iterable[str]) -> list[NodeAddress]:
        """Return the address of each node; its URI is None if the master does not know the node."""
        return [NodeAddress(node, self.node_uri(node)) for node in nodes]


def why_illegal(name: str) -> str:
    """Return why a topic's or service's global name is not legal, or "" if it is legal.

    rospy accepts illegal names, roscpp does not. A field path may follow a topic name: /points[0]/x.
    """
    if len(name) > _MAX_NAME_LENGTH:
        return f"a name has {_MAX_NAME_LENGTH} characters at most"
    legal = name != "/" and names.is_legal_name(re.sub(r"\[[^\[\]]*\]", "", name))
    return "" if legal else "that is not a legal name: letters, digits, _ and /"


def in_namespace(name: str, namespace: str) -> bool:
    """Return whether a global name is ``namespace`` or below it. All names are below the root namespace."""
    return namespace in ("", "/") or name == namespace or name.startswith(namespace.rstrip("/") + "/")


def node_host(uri: str | None) -> str | None:
    """Return the host name in a node's URI."""
    if not uri:
        return None
    return uri.partition("://")[2].partition("/")[0].rpartition(":")[0] or None


def unknown_topic(graph: Graph, topic: str) -> NotFoundError:
    """Return an error saying that a topic has no publishers or subscribers; it suggests existing topics with similar names."""
    state = graph.state()
    return NotFoundError("topic", topic, [*state.publishers, *state.subscribers])


def unknown_service(graph: Graph, service: str) -> NotFoundError:
    """Return an error saying that a service does not exist; it suggests existing services with similar names."""
    return NotFoundError("service", service, graph.state().services)
