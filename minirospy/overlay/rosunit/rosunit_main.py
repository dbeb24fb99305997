"""rosunit.rosunit_main, provided by minirospy: the command."""

from minirospy.compat.rosunit import rosunitmain

__all__ = ["rosunitmain"]
