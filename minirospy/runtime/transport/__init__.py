"""Transport: TCP and Unix sockets, links of topics, the event loop, worker threads, limits."""
