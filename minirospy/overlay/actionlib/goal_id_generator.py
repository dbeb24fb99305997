"""actionlib.goal_id_generator, provided by minirospy."""

from minirospy.actionlib import GoalIDGenerator

__all__ = ["GoalIDGenerator"]
