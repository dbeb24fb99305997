"""rostest.rostest_main: the command."""

from minirospy.ros.rostest.rostest import rostestmain

__all__ = ["rostestmain"]
