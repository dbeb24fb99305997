"""rosgraph.impl.graph: the graph as edges between nodes and topics.

All data comes from the master, so ``update()`` waits for no node, and ``bad_nodes`` is always empty.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator

from minirospy.introspect.graph import in_namespace
from minirospy.ros.rosgraph.rosgraph.masterapi import Master

__all__ = ["BadNode", "Edge", "EdgeList", "Graph", "edge_args", "node_topic", "topic_node"]

_CALLER_ID = "/rosgraph"


def topic_node(topic: str) -> str:
    """Return the name of the graph node that represents a topic: a space followed by the topic."""
    return " " + topic


def node_topic(node: str) -> str:
    """Return the topic for a name returned by :func:`topic_node`."""
    return node[1:]


class BadNode:
    """A node that does not respond correctly."""

    DEAD = 0
    WONKY = 1

    def __init__(self, name: str, type: int, reason: object) -> None:
        self.name = name
        self.type = type
        self.reason = reason


class Edge:
    """A directed edge from ``start`` to ``end`` with the topic ``label``."""

    __slots__ = ["end", "key", "label", "rkey", "start"]

    def __init__(self, start: str, end: str, label: str = "") -> None:
        self.start = start
        self.end = end
        self.label = label
        self.key = f"{start}|{label}"
        self.rkey = f"{end}|{label}"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Edge) and (self.start, self.end, self.label) == (
            other.start,
            other.end,
            other.label,
        )

    def __hash__(self) -> int:
        return hash((self.start, self.end, self.label))

    def __str__(self) -> str:
        return f"{self.start}->{self.end}"


class EdgeList:
    """A set of edges in insertion order."""

    def __init__(self, edges: Iterable[Edge] = ()) -> None:
        self._edges = dict.fromkeys(edges)

    def __iter__(self) -> Iterator[Edge]:
        return iter(list(self._edges))

    def __contains__(self, edge: Edge) -> bool:
        return edge in self._edges

    def __len__(self) -> int:
        return len(self._edges)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, EdgeList) and self._edges.keys() == other._edges.keys()

    __hash__ = None  # type: ignore[assignment]

    def has(self, edge: Edge) -> bool:
        """Return whether the list contains an edge."""
        return edge in self._edges

    def add(self, edge: Edge) -> bool:
        """Add an edge; return False if it already exists."""
        if edge in self._edges:
            return False
        self._edges[edge] = None
        return True

    def add_edges(self, start: str, dest: str, direction: str, label: str = "") -> bool:
        """Add the edges for a getBusInfo row (see :func:`edge_args`); return whether any is new."""
        added = [self.add(Edge(*each)) for each in edge_args(start, dest, direction, label)]
        return any(added)

    def delete(self, edge: Edge) -> None:
        """Remove an edge."""
        self._edges.pop(edge, None)

    def delete_all(self, node: str) -> None:
        """Remove all edges that start or end at a node."""
        self._edges = {each: None for each in self._edges if node not in (each.start, each.end)}


def edge_args(start: str, dest: str, direction: str, label: str) -> list[tuple[str, str, str]]:
    """Return [(start, end, label)] for a getBusInfo row.

    The edge is reversed for direction ``i``. Direction ``b`` results in two edges, an unknown direction in none.
    """
    there, back = (start, dest, label), (dest, start, label)
    return {"o": [there], "i": [back], "b": [there, back]}.get(direction, [])


class Graph:
    """The nodes and topics in the namespaces ``node_ns`` and ``topic_ns``, empty until :meth:`update` is called.

    ``nn_nodes``: node names; ``nt_nodes``: topics, named by :func:`topic_node`; ``nn_edges``: from node to node;
    ``nt_edges``, ``nt_all_edges``: from node to topic and from topic to node; ``srvs``: service names.
    """

    def __init__(self, node_ns: str = "/", topic_ns: str = "/") -> None:
        self.master = Master(_CALLER_ID)
        self.node_ns = node_ns or "/"
        self.topic_ns = topic_ns or "/"
        self.nn_nodes: set[str] = set()
        self.nt_nodes: set[str] = set()
        self.srvs: set[str] = set()
        self.bad_nodes: dict[str, BadNode] = {}
        self.nn_edges = EdgeList()
        self.nt_edges = EdgeList()
        self.nt_all_edges = EdgeList()
        self.master_stale = self.node_stale = 5.0
        self.last_master_refresh = 0.0

    def set_master_stale(self, stale_secs: float) -> None:
        """Set the minimum number of seconds between queries to the master."""
        self.master_stale = stale_secs

    def set_node_stale(self, stale_secs: float) -> None:
        """Store ``stale_secs``, which has no effect, because nodes are not queried."""
        self.node_stale = stale_secs

    def bad_update(self) -> bool:
        """Return False, because no node is queried (in ROS: query the nodes in ``bad_nodes`` again)."""
        return False

    def update(self) -> bool:
        """Query the master, unless it was queried recently; return whether the graph has changed."""
        if time.time() - self.last_master_refresh < self.master_stale:
            return False

        publishers, subscribers, services = self.master.getSystemState()
        self.last_master_refresh = time.time()

        before = (self.nn_nodes, self.nt_nodes, self.srvs, self.nn_edges, self.nt_all_edges)

        sending, hearing = self._side(publishers), self._side(subscribers)
        providers = {node for _, nodes in services for node in nodes if in_namespace(node, self.node_ns)}
        self.srvs = {name for name, _ in services}

        self.nn_nodes = {
            node for side in (sending, hearing) for nodes in side.values() for node in nodes
        } | providers
        self.nt_nodes = {topic_node(topic) for topic in {*sending, *hearing}}

        self.nn_edges = EdgeList(
            Edge(start, end, topic)
            for topic, nodes in sending.items()
            for start in nodes
            for end in hearing.get(topic, ())
        )
        self.nt_all_edges = EdgeList(
            [Edge(node, topic_node(topic), topic) for topic, nodes in sending.items() for node in nodes]
            + [Edge(topic_node(topic), node, topic) for topic, nodes in hearing.items() for node in nodes]
        )
        self.nt_edges = EdgeList(
            each for each in self.nt_all_edges if each.label in sending and each.label in hearing
        )
        return before != (self.nn_nodes, self.nt_nodes, self.srvs, self.nn_edges, self.nt_all_edges)

    def _side(self, table: list[tuple[str, list[str]]]) -> dict[str, list[str]]:
        """Return the topics in the topic namespace, each with its nodes in the node namespace."""
        kept = {
            topic: [node for node in nodes if in_namespace(node, self.node_ns)]
            for topic, nodes in table
            if in_namespace(topic, self.topic_ns)
        }
        return {topic: nodes for topic, nodes in kept.items() if nodes}
