"""roslaunch.server, provided by minirospy: the names that programs import from it."""

from minirospy.compat.roslaunch.core import RLException
from minirospy.compat.roslaunch.pmon import Process, ProcessListener

__all__ = ["Process", "ProcessListener", "RLException"]
