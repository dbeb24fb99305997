"""actionlib.server_goal_handle, provided by minirospy."""

from minirospy.ros.actionlib.actionlib import ServerGoalHandle

__all__ = ["ServerGoalHandle"]
