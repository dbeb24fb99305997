"""Transport: TCP and Unix sockets, topic links, the event loop, worker threads, limits."""
