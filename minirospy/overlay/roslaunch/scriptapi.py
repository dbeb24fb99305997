"""roslaunch.scriptapi, filled in by minirospy."""

from minirospy.launch.config import Node
from minirospy.launch.parent import ROSLaunch

__all__ = ["Node", "ROSLaunch"]
