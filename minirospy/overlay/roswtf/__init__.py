"""roswtf, provided by minirospy: what is wrong with a graph. Source: http://wiki.ros.org/roswtf."""

from minirospy.ros.roswtf.roswtf import roswtf_main

__all__ = ["roswtf_main"]
