"""roslaunch.roslaunch_logs: the log folder of the current run."""

from minirospy.ros.roslaunch.commands.roslaunch_logs import get_run_id
from minirospy.ros.roslaunch.commands.roslaunch_logs import main as logs_main

__all__ = ["NAME", "get_run_id", "logs_main"]

NAME = "roslaunch-logs"
