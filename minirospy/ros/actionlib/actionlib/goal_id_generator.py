"""The names of actionlib.goal_id_generator."""

from minirospy.ros.actionlib.actionlib import GoalIDGenerator

__all__ = ["GoalIDGenerator"]
