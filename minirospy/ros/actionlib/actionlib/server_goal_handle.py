"""Provides the names in ROS's module actionlib.server_goal_handle."""

from minirospy.ros.actionlib.actionlib.handle import ServerGoalHandle

__all__ = ["ServerGoalHandle"]
