"""The names of actionlib.simple_action_server."""

from actionlib_msgs.msg import GoalStatus

from minirospy.ros.actionlib.actionlib import ActionServer, ServerGoalHandle, SimpleActionServer, nop_cb

__all__ = ["ActionServer", "GoalStatus", "ServerGoalHandle", "SimpleActionServer", "nop_cb"]
