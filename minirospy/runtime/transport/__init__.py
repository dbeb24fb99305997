"""Sockets: TCP and Unix, links of topics, the loop and its threads, limits."""
