"""tf2_ros.buffer_client: the client of a buffer server. Source: http://wiki.ros.org/tf2_ros."""

from actionlib_msgs.msg import GoalStatus
from tf2_msgs.msg import LookupTransformAction, LookupTransformGoal

from minirospy.ros.tf2_ros.tf2_ros.client import BufferClient

__all__ = ["BufferClient", "GoalStatus", "LookupTransformAction", "LookupTransformGoal"]
