"""rosunit.pmon: watches processes, with the same names as roslaunch.pmon."""

from minirospy.ros.roslaunch.roslaunch.pmon import (
    Process,
    ProcessListener,
    ProcessMonitor,
    pmon_shutdown,
    shutdown_process_monitor,
    start_process_monitor,
)

__all__ = [
    "Process",
    "ProcessListener",
    "ProcessMonitor",
    "pmon_shutdown",
    "shutdown_process_monitor",
    "start_process_monitor",
]
