"""rosapi: services that report on the graph, for rosbridge clients, which cannot query the master."""
