"""actionlib.server_goal_handle, provided by minirospy."""

from minirospy.actionlib import ServerGoalHandle

__all__ = ["ServerGoalHandle"]
