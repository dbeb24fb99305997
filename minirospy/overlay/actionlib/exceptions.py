"""actionlib.exceptions, provided by minirospy."""

from minirospy.ros.actionlib.actionlib import ActionException

__all__ = ["ActionException"]
