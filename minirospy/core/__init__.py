"""The pure rooms: bytes, specs and tables in, values and actions out; no socket, loop or thread."""
