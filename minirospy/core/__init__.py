"""The pure packages: they compute values and actions from bytes, specs and tables, without sockets, event loops or threads."""
