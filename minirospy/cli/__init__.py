"""The commands. A command is a typed function and a `main(argv) -> int`; the logic is in the modules that they call."""
