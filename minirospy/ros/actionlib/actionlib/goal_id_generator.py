"""Provides the names in ROS's module actionlib.goal_id_generator."""

from minirospy.ros.actionlib.actionlib.goal_id import GoalIDGenerator

__all__ = ["GoalIDGenerator"]
