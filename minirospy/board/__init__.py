"""General-purpose pins: the virtual board that processes share, and the RPi.GPIO API on it.

The way of an edge, file by file: rpigpio (what `import RPi.GPIO` gives) or board (the Python API) -> link
(blocking client, mirrors the pins) -> protocol (messages <-> bytes) ==> server (one process a board) -> model
(what a board does: pure) ==> every other process's link -> its callbacks. place says where a board lives.
"""
