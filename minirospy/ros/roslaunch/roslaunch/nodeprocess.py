"""roslaunch.nodeprocess: the process of a node."""

from minirospy.ros.roslaunch.launcher.process import Timeouts
from minirospy.ros.roslaunch.roslaunch.core import Machine, Master, Node, RLException
from minirospy.ros.roslaunch.roslaunch.pmon import Process, create_node_process
from minirospy.ros.roslaunch.roslaunch.pmon import Process as LocalProcess
from minirospy.ros.submodules import modules_on_first_use

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

__getattr__ = modules_on_first_use(
    "roslaunch.nodeprocess",
    "errno logging os re rosgraph rospkg signal socket subprocess sys time traceback",
)

DEFAULT_TIMEOUT_SIGINT, DEFAULT_TIMEOUT_SIGTERM = Timeouts.interrupt, Timeouts.terminate
