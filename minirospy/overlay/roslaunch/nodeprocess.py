"""roslaunch.nodeprocess, filled in by minirospy."""

from minirospy.launch.config import Machine, Master, Node, RLException
from minirospy.launch.monitor import Process, create_node_process
from minirospy.launch.monitor import Process as LocalProcess
from minirospy.launch.process import Timeouts

__all__ = [
    "DEFAULT_TIMEOUT_SIGINT",
    "DEFAULT_TIMEOUT_SIGTERM",
    "LocalProcess",
    "Machine",
    "Master",
    "Node",
    "Process",
    "RLException",
    "create_node_process",
]

DEFAULT_TIMEOUT_SIGINT, DEFAULT_TIMEOUT_SIGTERM = Timeouts.interrupt, Timeouts.terminate
