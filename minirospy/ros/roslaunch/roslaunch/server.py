"""roslaunch.server: the names that programs import from it."""

from minirospy.ros.roslaunch.roslaunch.core import RLException
from minirospy.ros.roslaunch.roslaunch.pmon import Process, ProcessListener

__all__ = ["Process", "ProcessListener", "RLException"]
