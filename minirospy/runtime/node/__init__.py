"""A node: its Slave API, topics and services."""
