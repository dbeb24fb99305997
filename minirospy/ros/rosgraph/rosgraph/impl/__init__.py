"""rosgraph.impl: the graph as it is polled."""
