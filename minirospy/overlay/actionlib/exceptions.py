"""actionlib.exceptions, filled in by minirospy."""

from minirospy.actionlib import ActionException

__all__ = ["ActionException"]
