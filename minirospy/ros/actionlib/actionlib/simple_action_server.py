"""The names of actionlib.simple_action_server."""

from actionlib_msgs.msg import GoalStatus

from minirospy.ros.actionlib.actionlib import ActionServer, ServerGoalHandle, SimpleActionServer, nop_cb
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["ActionServer", "GoalStatus", "ServerGoalHandle", "SimpleActionServer", "nop_cb"]

__getattr__ = modules_on_first_use("actionlib.simple_action_server", "rospy threading traceback")
