"""rosunit.rosunit_main: the command rosunit."""

from minirospy.ros.rosunit.rosunit import rosunitmain

__all__ = ["rosunitmain"]
