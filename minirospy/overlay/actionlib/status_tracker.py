"""actionlib.status_tracker, filled in by minirospy."""

from minirospy.actionlib import StatusTracker

__all__ = ["StatusTracker"]
