"""tf2_ros.static_transform_broadcaster, provided by minirospy: transforms to /tf_static. Source: http://wiki.ros.org/tf2_ros."""

from geometry_msgs.msg import TransformStamped as TransformStamped
from tf2_msgs.msg import TFMessage as TFMessage

from minirospy.ros.tf2_ros.tf2_ros.broadcasters import (
    StaticTransformBroadcaster as StaticTransformBroadcaster,
)
