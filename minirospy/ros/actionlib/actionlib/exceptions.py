"""The names of actionlib.exceptions."""

from minirospy.ros.actionlib.actionlib import ActionException

__all__ = ["ActionException"]
