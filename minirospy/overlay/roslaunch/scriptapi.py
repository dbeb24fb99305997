"""roslaunch.scriptapi, filled in by minirospy."""

from minirospy.compat.roslaunch.core import Master, Node, RLException
from minirospy.compat.roslaunch.scriptapi import ROSLaunch

__all__ = ["Master", "Node", "RLException", "ROSLaunch"]
