"""rostest.rostest_main, provided by minirospy: the command."""

from minirospy.compat.rostest import rostestmain

__all__ = ["rostestmain"]
