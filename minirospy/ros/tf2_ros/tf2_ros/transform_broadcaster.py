"""tf2_ros.transform_broadcaster: publishes transforms on /tf. Source: http://wiki.ros.org/tf2_ros."""

from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from minirospy.ros.tf2_ros.tf2_ros.broadcasters import TransformBroadcaster

__all__ = ["TFMessage", "TransformBroadcaster", "TransformStamped"]
