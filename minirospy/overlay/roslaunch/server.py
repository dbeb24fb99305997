"""roslaunch.server, filled in by minirospy: what programs take from it; the parent's server is no business of theirs."""

from minirospy.compat.roslaunch.core import RLException
from minirospy.compat.roslaunch.pmon import Process, ProcessListener

__all__ = ["Process", "ProcessListener", "RLException"]
