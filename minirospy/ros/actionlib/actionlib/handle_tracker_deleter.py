"""The names of actionlib.handle_tracker_deleter."""

from minirospy.ros.actionlib.actionlib import HandleTrackerDeleter

__all__ = ["HandleTrackerDeleter"]
