"""rosgraph.impl.graph: the graph as edges between nodes and topics.

All of it comes from the master, so that ``update()`` waits for no node; so none is ever in ``bad_nodes``.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator

from minirospy.introspect.graph import in_namespace
from minirospy.ros.rosgraph.rosgraph.masterapi import Master

__all__ = ["BadNode", "Edge", "EdgeList", "Graph", "edge_args", "node_topic", "topic_node"]

_CALLER_ID = "/rosgraph"


def topic_node(topic: str) -> str:
    """Return a topic's node in the graph: its name after a space."""
    return " " + topic


def node_topic(node: str) -> str:
    """Return the topic of a name made by :func:`topic_node`."""
    return node[1:]


class BadNode:
    """A node that does not answer as it should."""

    DEAD = 0
    WONKY = 1

    def __init__(self, name: str, type: int, reason: object) -> None:
        self.name = name
        self.type = type
        self.reason = reason


class Edge:
    """A line from ``start`` to ``end``, for the topic ``label``."""

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
    """Edges, each once, in the order in which they came."""

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
        """Return whether an edge is there."""
        return edge in self._edges

    def add(self, edge: Edge) -> bool:
        """Add an edge; False if it is there."""
        if edge in self._edges:
            return False
        self._edges[edge] = None
        return True

    def add_edges(self, start: str, dest: str, direction: str, label: str = "") -> bool:
        """Add the edge of a row of getBusInfo, both for the direction ``b``; return whether one is new."""
        added = [self.add(Edge(*each)) for each in edge_args(start, dest, direction, label)]
        return any(added)

    def delete(self, edge: Edge) -> None:
        """Take an edge out."""
        self._edges.pop(edge, None)

    def delete_all(self, node: str) -> None:
        """Take out every edge that starts or ends at a node."""
        self._edges = {each: None for each in self._edges if node not in (each.start, each.end)}


def edge_args(start: str, dest: str, direction: str, label: str) -> list[tuple[str, str, str]]:
    """Return [(start, end, label)] of a row of getBusInfo: reversed for the direction ``i``, both for ``b``, none for another."""
    there, back = (start, dest, label), (dest, start, label)
    return {"o": [there], "i": [back], "b": [there, back]}.get(direction, [])


class Graph:
    """The graph at and below ``node_ns`` and ``topic_ns``, once :meth:`update` was called.

    ``nn_nodes``: node names; ``nt_nodes``: topics as :func:`topic_node` names them; ``nn_edges``: from node to node;
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
        """Set the seconds between queries of the master."""
        self.master_stale = stale_secs

    def set_node_stale(self, stale_secs: float) -> None:
        """Accept the seconds between queries of a node; has no effect, as nodes are not queried."""
        self.node_stale = stale_secs

    def bad_update(self) -> bool:
        """Query the nodes in ``bad_nodes`` again. Return False, as there are none."""
        return False

    def update(self) -> bool:
        """Query the master, unless the last query is recent. Return whether the graph has changed."""
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
        """Return topic -> nodes, of the topics in the namespace."""
        kept = {
            topic: [node for node in nodes if in_namespace(node, self.node_ns)]
            for topic, nodes in table
            if in_namespace(topic, self.topic_ns)
        }
        return {topic: nodes for topic, nodes in kept.items() if nodes}
