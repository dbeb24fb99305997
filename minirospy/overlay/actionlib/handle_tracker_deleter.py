"""actionlib.handle_tracker_deleter, provided by minirospy."""

from minirospy.ros.actionlib.actionlib import HandleTrackerDeleter

__all__ = ["HandleTrackerDeleter"]
