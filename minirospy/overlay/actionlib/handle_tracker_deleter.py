"""actionlib.handle_tracker_deleter, filled in by minirospy."""

from minirospy.actionlib import HandleTrackerDeleter

__all__ = ["HandleTrackerDeleter"]
