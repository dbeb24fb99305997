"""rosgraph.impl, filled in by minirospy."""

from rosgraph.impl import graph as graph
