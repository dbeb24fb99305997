"""tf2_ros.transform_broadcaster, provided by minirospy: transforms to /tf. Source: http://wiki.ros.org/tf2_ros."""

from geometry_msgs.msg import TransformStamped as TransformStamped
from tf2_msgs.msg import TFMessage as TFMessage

from minirospy.ros.tf2_ros.tf2_ros.broadcasters import TransformBroadcaster as TransformBroadcaster
