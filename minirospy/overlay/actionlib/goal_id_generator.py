"""actionlib.goal_id_generator, filled in by minirospy."""

from minirospy.actionlib import GoalIDGenerator

__all__ = ["GoalIDGenerator"]
