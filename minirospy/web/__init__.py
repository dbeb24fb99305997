"""Servers that make the graph accessible to browsers and to programs without ROS, for example with the Foxglove protocol.

Install with ``python -m pip install "minirospy[web]"``. docs/bridge.md describes how to use them.
"""
