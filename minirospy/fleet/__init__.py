"""A fleet of robots, each with its own master, over Zenoh. How to use it: docs/fleet.md."""
