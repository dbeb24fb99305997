"""Servers that make the graph accessible to browsers and to programs without ROS, for example with the Foxglove protocol.

They need the extra ``web``: docs/bridge.md describes how to install and use them.
"""
