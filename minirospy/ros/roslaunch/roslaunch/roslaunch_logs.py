"""roslaunch.roslaunch_logs: the log folder of the current run."""

__all__ = ["NAME"]

NAME = "roslaunch-logs"
