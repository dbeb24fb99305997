"""roslaunch.pmon, provided by minirospy."""

from minirospy.ros.roslaunch.roslaunch.core import RLException
from minirospy.ros.roslaunch.roslaunch.pmon import (
    Process,
    ProcessListener,
    ProcessMonitor,
    pmon_shutdown,
    rl_signal,
    shutdown_process_monitor,
    start_process_monitor,
)
from minirospy.ros.roslaunch.roslaunch.pmon import init_signal_handlers as _init_signal_handlers

__all__ = [
    "Process",
    "ProcessListener",
    "ProcessMonitor",
    "RLException",
    "_init_signal_handlers",
    "pmon_shutdown",
    "rl_signal",
    "shutdown_process_monitor",
    "start_process_monitor",
]
