"""tf2_ros.transform_listener, provided by minirospy: /tf and /tf_static into a buffer. Source: http://wiki.ros.org/tf2_ros."""

from tf2_msgs.msg import TFMessage as TFMessage

from minirospy.frames.listener import TransformListener as TransformListener
