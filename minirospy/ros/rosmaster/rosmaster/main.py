"""rosmaster.main: the command."""

from minirospy.ros.rosmaster.rosmaster import rosmaster_main

__all__ = ["rosmaster_main"]
