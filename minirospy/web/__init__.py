"""Servers that open the graph to browsers and to programs without ROS, such as the Foxglove WebSocket protocol.

``python -m pip install "minirospy[web]"``. How to use it: docs/bridge.md.
"""
