"""roslaunch.parent, filled in by minirospy."""

from minirospy.launch.parent import ROSLaunchParent

__all__ = ["ROSLaunchParent"]
