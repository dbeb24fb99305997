"""tf2_ros.static_transform_broadcaster: publishes transforms on /tf_static. Source: http://wiki.ros.org/tf2_ros."""

from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from minirospy.ros.tf2_ros.tf2_ros.broadcasters import StaticTransformBroadcaster

__all__ = ["StaticTransformBroadcaster", "TFMessage", "TransformStamped"]
