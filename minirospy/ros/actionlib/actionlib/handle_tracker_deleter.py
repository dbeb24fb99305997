"""Provides the names in ROS's module actionlib.handle_tracker_deleter."""

from minirospy.ros.actionlib.actionlib.handle import HandleTrackerDeleter

__all__ = ["HandleTrackerDeleter"]
