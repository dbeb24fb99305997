"""roslaunch.remote: programs import it, though ROSLaunchParent alone starts other machines' nodes."""

from minirospy.ros.roslaunch.roslaunch.core import RLException, is_machine_local

__all__ = ["RLException", "is_machine_local"]
