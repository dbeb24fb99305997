"""roslaunch.nodeprocess."""

from minirospy.ros.roslaunch.launcher.process import Timeouts

__all__ = ["DEFAULT_TIMEOUT_SIGINT", "DEFAULT_TIMEOUT_SIGTERM"]

DEFAULT_TIMEOUT_SIGINT, DEFAULT_TIMEOUT_SIGTERM = Timeouts.interrupt, Timeouts.terminate
