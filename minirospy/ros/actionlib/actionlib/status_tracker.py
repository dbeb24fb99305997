"""The names of actionlib.status_tracker."""

from minirospy.ros.actionlib.actionlib.handle import StatusTracker

__all__ = ["StatusTracker"]
