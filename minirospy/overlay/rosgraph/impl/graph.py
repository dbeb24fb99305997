"""rosgraph.impl.graph, provided by minirospy: the graph as edges between nodes and topics."""

from minirospy.ros.rosgraph.rosgraph.impl.graph import (
    BadNode,
    Edge,
    EdgeList,
    Graph,
    edge_args,
    node_topic,
    topic_node,
)

__all__ = ["BadNode", "Edge", "EdgeList", "Graph", "edge_args", "node_topic", "topic_node"]
