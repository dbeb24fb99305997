"""rosgraph.impl: polls the graph."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.rosgraph.rosgraph.impl import graph

__all__ = ["graph"]
