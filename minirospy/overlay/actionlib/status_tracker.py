"""actionlib.status_tracker, provided by minirospy."""

from minirospy.ros.actionlib.actionlib import StatusTracker

__all__ = ["StatusTracker"]
