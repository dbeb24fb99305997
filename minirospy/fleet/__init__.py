"""Connects a fleet of robots, each with its own master, over Zenoh. docs/fleet.md describes how to use it."""
