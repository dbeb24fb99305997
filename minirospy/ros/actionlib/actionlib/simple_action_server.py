"""Provides the names in ROS's module actionlib.simple_action_server."""

from actionlib_msgs.msg import GoalStatus

from minirospy.ros.actionlib.actionlib.handle import ServerGoalHandle
from minirospy.ros.actionlib.actionlib.server import ActionServer, nop_cb
from minirospy.ros.actionlib.actionlib.simple_server import SimpleActionServer

__all__ = ["ActionServer", "GoalStatus", "ServerGoalHandle", "SimpleActionServer", "nop_cb"]
