"""The pure packages: bytes, specs and tables as input, values and actions as output; no sockets, event loops or threads."""
