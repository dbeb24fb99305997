"""roslaunch.pmon, filled in by minirospy."""

from minirospy.launch.parent import Process, ProcessListener, ProcessMonitor

__all__ = ["Process", "ProcessListener", "ProcessMonitor"]
