"""The names of actionlib.exceptions."""

from minirospy.ros.actionlib.actionlib.spec import ActionException

__all__ = ["ActionException"]
