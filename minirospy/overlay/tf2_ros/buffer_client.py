"""tf2_ros.buffer_client, provided by minirospy: lookups at a buffer server. Source: http://wiki.ros.org/tf2_ros."""

from actionlib_msgs.msg import GoalStatus as GoalStatus
from tf2_msgs.msg import LookupTransformAction as LookupTransformAction
from tf2_msgs.msg import LookupTransformGoal as LookupTransformGoal

from minirospy.ros.tf2_ros.tf2_ros.client import BufferClient as BufferClient
