"""rosapi: services that report about the graph, for rosbridge clients, which cannot query the master."""
