"""rosapi: questions about the graph as services, for clients of rosbridge, which have no master to query."""
