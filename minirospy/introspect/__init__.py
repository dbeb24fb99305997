"""Questions about a running graph, and their answers as records: what commands print and a dashboard shows.

A :class:`minirospy.introspect.graph.Graph` (a master, and how names are resolved) comes in; named tuples go
out. Nothing here prints or reads a command line. What only calls the master and other nodes' XML-RPC
(`topics`, `nodes`, `services`, `parameters`) blocks its caller and imports no asyncio; what listens or
publishes (`streams`) is a separate node; `interfaces` reads the definitions of the installed packages. What
is left is pure: `fields`, `values`, `messages`, `echo`, `plot` and `rates`.
"""
