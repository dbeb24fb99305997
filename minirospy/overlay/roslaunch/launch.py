"""roslaunch.launch, filled in by minirospy."""

from minirospy.launch.config import Machine, Master, Node, Param, RLException, Test
from minirospy.launch.monitor import ProcessListener, start_process_monitor
from minirospy.launch.monitor import ProcessListener as ROSLaunchListener
from minirospy.launch.parent import ROSLaunchRunner

__all__ = [
    "Machine",
    "Master",
    "Node",
    "Param",
    "ProcessListener",
    "RLException",
    "ROSLaunchListener",
    "ROSLaunchRunner",
    "Test",
    "start_process_monitor",
]
