"""The commands: a command is a typed function and a `main(argv) -> int`; thin over the rooms below."""
