"""roslaunch.remote: importable for compatibility, but only ROSLaunchParent starts nodes on other machines."""

from minirospy.ros.roslaunch.roslaunch.core import RLException, is_machine_local

__all__ = ["RLException", "is_machine_local"]
