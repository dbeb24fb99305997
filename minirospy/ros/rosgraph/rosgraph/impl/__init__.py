"""rosgraph.impl: polling the graph."""
