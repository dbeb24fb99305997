"""The graph that the questions are about: a master, and the names as the asker sees them."""

from __future__ import annotations

import contextlib
import os
from typing import TYPE_CHECKING, NamedTuple

from minirospy import names
from minirospy.environment import master_and_namespace
from minirospy.errors import NotFoundError, RpcRefused
from minirospy.runtime.master_proxy import MasterProxy

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from minirospy.runtime.master_proxy import SystemState

__all__ = ["Graph", "NodeAddress", "in_namespace", "node_host", "unknown_service", "unknown_topic"]


class NodeAddress(NamedTuple):
    """A node's name and the URI of its Slave API; None where the master does not know it."""

    name: str
    uri: str | None


class Graph:
    """A master, asked in the name of ``tool``; names are resolved in ``namespace``. A context manager.

    Every call raises MasterUnreachableError where no master answers.
    """

    def __init__(self, master: MasterProxy, tool: str, namespace: str = "/") -> None:
        self.master = master
        self.tool = tool
        self._node_name = namespace.rstrip("/") + "/" + tool
        self._uris: dict[str, str | None] = {}

    @classmethod
    def open(cls, tool: str, environ: Mapping[str, str] | None = None) -> Graph:
        """The graph that the environment names. Raises UsageError on a bad ROS_MASTER_URI."""
        master_uri, namespace = master_and_namespace(os.environ if environ is None else environ)
        return cls(MasterProxy(master_uri, "/" + tool), tool, namespace)

    def __enter__(self) -> Graph:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection to the master. Idempotent."""
        self.master.close()

    def resolve(self, name: str) -> str:
        """The global name of ``name``."""
        return names.resolve(name, self._node_name)

    def state(self) -> SystemState:
        """Who publishes, subscribes and serves what."""
        return self.master.get_system_state()

    def node_uri(self, node: str) -> str | None:
        """The URI of a node's Slave API (asked once a node); None where the master does not know it."""
        if node not in self._uris:
            uri: str | None = None
            with contextlib.suppress(RpcRefused):
                uri = self.master.lookup_node(node)
            self._uris[node] = uri
        return self._uris[node]

    def addresses(self, nodes: Iterable[str]) -> list[NodeAddress]:
        """Each node with its URI."""
        return [NodeAddress(node, self.node_uri(node)) for node in nodes]


def in_namespace(name: str, namespace: str) -> bool:
    """Whether a global name is ``namespace`` or lies below it; the root holds all."""
    return namespace in ("", "/") or name == namespace or name.startswith(namespace.rstrip("/") + "/")


def node_host(uri: str | None) -> str | None:
    """The host name in a node's URI."""
    if not uri:
        return None
    return uri.partition("://")[2].partition("/")[0].rpartition(":")[0] or None


def unknown_topic(graph: Graph, topic: str) -> NotFoundError:
    """The error for a topic that nobody publishes or subscribes to, with the nearest that are there."""
    state = graph.state()
    return NotFoundError("topic", topic, [*state.publishers, *state.subscribers])


def unknown_service(graph: Graph, service: str) -> NotFoundError:
    """The error for a service that nobody offers, with the nearest that are there."""
    return NotFoundError("service", service, graph.state().services)
