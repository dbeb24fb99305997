"""rostest.rostest_main: the command rostest."""

from minirospy.ros.rostest.rostest import rostestmain

__all__ = ["rostestmain"]
