"""roslaunch.launch, provided by minirospy: run a configuration that the program has made."""

from minirospy.ros.roslaunch.roslaunch.core import Machine, Master, Node, Param, RLException, Test
from minirospy.ros.roslaunch.roslaunch.launch import RLTestTimeoutException, ROSLaunchRunner
from minirospy.ros.roslaunch.roslaunch.launch import unify_clear_params as _unify_clear_params
from minirospy.ros.roslaunch.roslaunch.pmon import ProcessListener, start_process_monitor
from minirospy.ros.roslaunch.roslaunch.pmon import ProcessListener as ROSLaunchListener

__all__ = [
    "Machine",
    "Master",
    "Node",
    "Param",
    "ProcessListener",
    "RLException",
    "RLTestTimeoutException",
    "ROSLaunchListener",
    "ROSLaunchRunner",
    "Test",
    "_unify_clear_params",
    "start_process_monitor",
]
