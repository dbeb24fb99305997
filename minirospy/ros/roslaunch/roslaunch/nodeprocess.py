"""roslaunch.nodeprocess: the process of a node."""

from minirospy.ros.roslaunch.launcher.process import Timeouts
from minirospy.ros.roslaunch.roslaunch.core import Machine, Master, Node, RLException
from minirospy.ros.roslaunch.roslaunch.pmon import LaunchedProcess as LocalProcess
from minirospy.ros.roslaunch.roslaunch.pmon import Process, create_node_process

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
