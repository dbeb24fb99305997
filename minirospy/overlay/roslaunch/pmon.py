"""roslaunch.pmon, filled in by minirospy."""

from minirospy.launch.config import RLException
from minirospy.launch.monitor import (
    Process,
    ProcessListener,
    ProcessMonitor,
    pmon_shutdown,
    rl_signal,
    shutdown_process_monitor,
    start_process_monitor,
)
from minirospy.launch.monitor import init_signal_handlers as _init_signal_handlers

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
