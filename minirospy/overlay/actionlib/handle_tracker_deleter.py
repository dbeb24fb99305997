"""actionlib.handle_tracker_deleter, provided by minirospy."""

from minirospy.actionlib import HandleTrackerDeleter

__all__ = ["HandleTrackerDeleter"]
