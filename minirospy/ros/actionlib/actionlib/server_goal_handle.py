"""The names of actionlib.server_goal_handle."""

from minirospy.ros.actionlib.actionlib import ServerGoalHandle
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["ServerGoalHandle"]

__getattr__ = modules_on_first_use("actionlib.server_goal_handle", "actionlib_msgs rospy")
