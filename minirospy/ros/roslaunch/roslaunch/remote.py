"""roslaunch.remote: can be imported for compatibility, but only ROSLaunchParent starts nodes on other machines."""

from minirospy.ros.roslaunch.roslaunch.core import RLException, is_machine_local
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["RLException", "is_machine_local"]

__getattr__ = modules_on_first_use(
    "roslaunch.remote",
    "logging network=rosgraph.network roslaunch socket time",
)
