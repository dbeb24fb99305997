"""tf2_ros.transform_listener: inserts /tf and /tf_static into a buffer. Source: http://wiki.ros.org/tf2_ros."""

from tf2_msgs.msg import TFMessage

from minirospy.ros.tf2_ros.tf2_ros.listener import TransformListener

__all__ = ["TFMessage", "TransformListener"]
