"""actionlib.goal_id_generator, provided by minirospy."""

from minirospy.ros.actionlib.actionlib import GoalIDGenerator

__all__ = ["GoalIDGenerator"]
