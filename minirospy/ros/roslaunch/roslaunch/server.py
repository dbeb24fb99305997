"""roslaunch.server: the names that programs import from this module."""

from minirospy.ros.roslaunch.roslaunch.core import RLException
from minirospy.ros.roslaunch.roslaunch.pmon import Process, ProcessListener
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["Process", "ProcessListener", "RLException"]

__getattr__ = modules_on_first_use(
    "roslaunch.server",
    "errno logging network=rosgraph.network os roslaunch socket sys time traceback xmlrpc=rosgraph.xmlrpc",
)
