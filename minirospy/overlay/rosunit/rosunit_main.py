"""rosunit.rosunit_main, provided by minirospy: the command."""

from minirospy.ros.rosunit.rosunit import rosunitmain

__all__ = ["rosunitmain"]
