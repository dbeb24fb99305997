"""The names of actionlib.status_tracker."""

from minirospy.ros.actionlib.actionlib import StatusTracker

__all__ = ["StatusTracker"]
