"""actionlib.status_tracker, provided by minirospy."""

from minirospy.actionlib import StatusTracker

__all__ = ["StatusTracker"]
