"""Provides the names in ROS's module actionlib.status_tracker."""

from minirospy.ros.actionlib.actionlib.handle import StatusTracker

__all__ = ["StatusTracker"]
