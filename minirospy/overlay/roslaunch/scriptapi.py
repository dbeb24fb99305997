"""roslaunch.scriptapi, filled in by minirospy."""

from minirospy.launch.config import Master, Node, RLException
from minirospy.launch.parent import ROSLaunch

__all__ = ["Master", "Node", "RLException", "ROSLaunch"]
