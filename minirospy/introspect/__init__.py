"""Queries about a running graph that return records, which commands print and a dashboard shows.

The functions take a :class:`minirospy.introspect.graph.Graph` (a master, and the rules for resolving names) and return
named tuples. Nothing here prints or reads a command line. Modules that only call the XML-RPC APIs of the master and of
nodes (`topics`, `nodes`, `services`, `parameters`) block the caller and do not import asyncio; listening and publishing
(`streams`) use a separate node; `interfaces` reads the definitions of the installed packages. The remaining modules are
pure: `fields`, `values`, `messages`, `echo`, `plot` and `rates`.
"""
