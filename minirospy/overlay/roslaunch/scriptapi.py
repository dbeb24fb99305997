"""roslaunch.scriptapi, filled in by minirospy."""

from minirospy.compat.roslaunch.config import Master, Node, RLException
from minirospy.compat.roslaunch.parent import ROSLaunch

__all__ = ["Master", "Node", "RLException", "ROSLaunch"]
