"""The commands. A command is a typed function and a `main(argv) -> int`; its logic is in the modules that it calls."""
