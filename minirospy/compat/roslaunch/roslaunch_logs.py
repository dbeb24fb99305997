"""roslaunch.roslaunch_logs, filled in by minirospy: where the log files of the present run lie."""

__all__ = ["NAME"]

NAME = "roslaunch-logs"
