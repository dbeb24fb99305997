"""genpy.genpy_main, provided by minirospy: the command line of message generators."""

from minirospy.ros.genpy.genpy.genpy_main import genmain, usage

__all__ = ["genmain", "usage"]
