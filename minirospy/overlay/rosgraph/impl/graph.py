"""rosgraph.impl.graph, filled in by minirospy: the graph as edges between nodes and topics.

All of it comes from the master, so that ``update()`` waits for no node; so none is ever in ``bad_nodes``.
"""

from minirospy.compat.rosgraph.impl.graph import (
    BadNode,
    Edge,
    EdgeList,
    Graph,
    edge_args,
    node_topic,
    topic_node,
)

__all__ = ["BadNode", "Edge", "EdgeList", "Graph", "edge_args", "node_topic", "topic_node"]
