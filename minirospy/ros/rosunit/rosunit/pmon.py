"""rosunit.pmon: processes that are watched, as roslaunch.pmon has them."""

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
