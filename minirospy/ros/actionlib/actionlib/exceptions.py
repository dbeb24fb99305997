"""Provides the names in ROS's module actionlib.exceptions."""

from minirospy.ros.actionlib.actionlib.spec import ActionException

__all__ = ["ActionException"]
