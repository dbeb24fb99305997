"""rostest.rostest_main, provided by minirospy: the command."""

from minirospy.ros.rostest.rostest import rostestmain

__all__ = ["rostestmain"]
