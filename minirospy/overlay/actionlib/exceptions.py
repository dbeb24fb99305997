"""actionlib.exceptions, provided by minirospy."""

from minirospy.actionlib import ActionException

__all__ = ["ActionException"]
