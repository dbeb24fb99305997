"""roslaunch.parent, filled in by minirospy."""

from minirospy.launch.config import RLException, load_config_default
from minirospy.launch.parent import ROSLaunchParent

__all__ = ["RLException", "ROSLaunchParent", "load_config_default"]
