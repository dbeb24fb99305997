"""General-purpose pins: the virtual board that processes share, and the RPi.GPIO API on it.

The path of an edge, file by file: rpigpio (the module of `import RPi.GPIO`) or board (the Python API) -> link
(blocking client, mirrors the pins) -> protocol (messages <-> bytes) ==> server (one process per board) -> model
(the behaviour of a board: pure) ==> every other process's link -> its callbacks. directory finds a board's files.
"""
