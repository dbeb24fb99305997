"""rosgraph.rosgraph_main, provided by minirospy: the command."""

from minirospy.ros.rosgraph.rosgraph.rosgraph_main import rosgraph_main

__all__ = [
    "rosgraph_main",
]
