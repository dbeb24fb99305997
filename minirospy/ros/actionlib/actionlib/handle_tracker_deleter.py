"""The names of actionlib.handle_tracker_deleter."""

from minirospy.ros.actionlib.actionlib import HandleTrackerDeleter
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["HandleTrackerDeleter"]

__getattr__ = modules_on_first_use("actionlib.handle_tracker_deleter", "rospy")
