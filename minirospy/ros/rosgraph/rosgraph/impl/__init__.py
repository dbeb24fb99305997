"""rosgraph.impl: the graph as it is polled."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.rosgraph.rosgraph.impl import graph

__all__ = ["graph"]
