"""roslaunch.parent, provided by minirospy."""

from minirospy.compat.roslaunch.config import load_config_default
from minirospy.compat.roslaunch.core import RLException
from minirospy.compat.roslaunch.parent import ROSLaunchParent

__all__ = ["RLException", "ROSLaunchParent", "load_config_default"]
