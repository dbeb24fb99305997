"""The pure packages: bytes, specs and tables in, values and actions out; no sockets, event loops or threads."""
