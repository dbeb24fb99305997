"""rosmaster.main: the command rosmaster."""

from minirospy.ros.rosmaster.rosmaster import rosmaster_main

__all__ = ["rosmaster_main"]
