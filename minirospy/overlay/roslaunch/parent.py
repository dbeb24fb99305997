"""roslaunch.parent, provided by minirospy."""

from minirospy.ros.roslaunch.roslaunch.config import load_config_default
from minirospy.ros.roslaunch.roslaunch.core import RLException
from minirospy.ros.roslaunch.roslaunch.parent import ROSLaunchParent

__all__ = ["RLException", "ROSLaunchParent", "load_config_default"]
