"""The names of actionlib.goal_id_generator."""

from minirospy.ros.actionlib.actionlib import GoalIDGenerator
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["GoalIDGenerator"]

__getattr__ = modules_on_first_use("actionlib.goal_id_generator", "rospy threading")
