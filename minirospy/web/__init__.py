"""Servers that open the graph to browsers and to programs without ROS, such as the Foxglove WebSocket protocol.

``python -m pip install "minirospy[web]"``. docs/bridge.md describes how to use them.
"""
