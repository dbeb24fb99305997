"""The names of actionlib.handle_tracker_deleter."""

from minirospy.ros.actionlib.actionlib.handle import HandleTrackerDeleter

__all__ = ["HandleTrackerDeleter"]
