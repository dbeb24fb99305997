"""The names of actionlib.server_goal_handle."""

from minirospy.ros.actionlib.actionlib.handle import ServerGoalHandle

__all__ = ["ServerGoalHandle"]
