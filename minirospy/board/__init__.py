"""General-purpose I/O pins: a virtual board shared by processes, and the RPi.GPIO API for it.

The path of an edge, file by file: rpigpio (the module for `import RPi.GPIO`) or board (the Python API) -> link (blocking
client, mirrors the pins) -> protocol (messages <-> bytes) ==> server (one process per board) -> model (a board's
behaviour: pure) ==> every other process's link -> its callbacks. The module ``directory`` finds a board's files.
"""
