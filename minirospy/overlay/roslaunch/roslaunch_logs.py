"""roslaunch.roslaunch_logs, provided by minirospy: the log folder of the current run."""

from minirospy.ros.roslaunch.commands.roslaunch_logs import get_run_id
from minirospy.ros.roslaunch.commands.roslaunch_logs import main as logs_main
from minirospy.ros.roslaunch.roslaunch.roslaunch_logs import NAME

__all__ = ["NAME", "get_run_id", "logs_main"]
