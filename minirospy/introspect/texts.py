"""Format the output of `rosnode info` and `rostopic info`. Pure, except for looking up addresses in the graph."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.introspect.nodes import list_nodes

if TYPE_CHECKING:
    from minirospy.introspect.graph import Graph, NodeAddress
    from minirospy.introspect.nodes import Connections, NodeDetail, TypedName
    from minirospy.introspect.topics import TopicDetail

__all__ = ["connections_text", "node_text", "topic_text"]

_DIRECTIONS = {"i": "inbound", "o": "outbound", "b": "bidirectional"}


def node_text(detail: NodeDetail) -> str:
    """Format the master's information about a node."""

    def section(title: str, rows: list[str]) -> str:
        return f"{title}: " + ("\n" + "\n".join(f" * {row}" for row in rows) if rows else "None") + "\n"

    def typed(topics: list[TypedName]) -> list[str]:
        return [f"{topic.name} [{topic.type}]" for topic in topics]

    return "\n".join(
        (
            f"Node [{detail.name}]",
            section("Publications", typed(detail.publications)),
            section("Subscriptions", typed(detail.subscriptions)),
            section("Services", detail.services),
        )
    )


def connections_text(graph: Graph, connections: Connections) -> str:
    """Format what a node reports about itself: its process ID and its connections."""
    lines = [f"Pid: {connections.pid}"]
    if connections.links:
        names = {graph.node_uri(node): node for node in list_nodes(graph)}
        lines.append("Connections:")
        for link in connections.links:
            to = link.destination
            # For an inbound connection, ``to`` is the publisher's URI instead of its name.
            shown = f"{names[to]} ({to})" if to in names else to
            lines += (
                f" * topic: {link.topic}",
                f"    * to: {shown}",
                f"    * direction: {_direction(link.direction, link.info)}",
                f"    * transport: {link.transport}",
            )
    return "\n".join(lines) + "\n"


def topic_text(detail: TopicDetail) -> str:
    """Format a topic's type, publishers and subscribers."""

    def side(title: str, nodes: list[NodeAddress]) -> str:
        if not nodes:
            return f"{title}: None\n"
        rows = (f" * {node.name} ({node.uri or f'unknown address {node.name}'})\n" for node in nodes)
        return f"{title}: \n" + "".join(rows)

    publishers, subscribers = side("Publishers", detail.publishers), side("Subscribers", detail.subscribers)
    return f"Type: {detail.type}\n\n{publishers}\n{subscribers}\n"


def _direction(direction: str, info: str) -> str:
    """Return ``outbound (port - host:port) [socket]``, with the numbers from the node's description of a connection."""
    import re

    match = re.match(r"\w+ connection on port (\S+) to \[(\S+) on socket (\d+)\]", info)
    numbers = f" ({match[1]} - {match[2]}) [{match[3]}]" if match else ""
    return _DIRECTIONS.get(direction, direction) + numbers
