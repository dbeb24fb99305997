"""actionlib.server_goal_handle, filled in by minirospy."""

from minirospy.actionlib import ServerGoalHandle

__all__ = ["ServerGoalHandle"]
