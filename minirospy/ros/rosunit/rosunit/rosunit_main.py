"""rosunit.rosunit_main: the command."""

from minirospy.ros.rosunit.rosunit import rosunitmain

__all__ = ["rosunitmain"]
