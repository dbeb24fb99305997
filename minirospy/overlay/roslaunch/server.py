"""roslaunch.server, filled in by minirospy: what programs take from it; the parent's server is no business of theirs."""

from minirospy.launch.config import RLException
from minirospy.launch.monitor import Process, ProcessListener

__all__ = ["Process", "ProcessListener", "RLException"]
