"""rosgraph.impl, provided by minirospy: the graph as it is polled."""

from rosgraph.impl import graph as graph
