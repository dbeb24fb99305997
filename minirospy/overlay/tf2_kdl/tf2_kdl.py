"""tf2_kdl.tf2_kdl, provided by minirospy: PyKDL's types for tf2_ros. Source: http://wiki.ros.org/tf2_kdl."""

from geometry_msgs.msg import PointStamped as PointStamped

from minirospy.ros.tf2_kdl.tf2_kdl.tf2_kdl import convert_vector as convert_vector
from minirospy.ros.tf2_kdl.tf2_kdl.tf2_kdl import do_transform_frame as do_transform_frame
from minirospy.ros.tf2_kdl.tf2_kdl.tf2_kdl import do_transform_twist as do_transform_twist
from minirospy.ros.tf2_kdl.tf2_kdl.tf2_kdl import do_transform_vector as do_transform_vector
from minirospy.ros.tf2_kdl.tf2_kdl.tf2_kdl import do_transform_wrench as do_transform_wrench
from minirospy.ros.tf2_kdl.tf2_kdl.tf2_kdl import from_msg_vector as from_msg_vector
from minirospy.ros.tf2_kdl.tf2_kdl.tf2_kdl import to_msg_vector as to_msg_vector
from minirospy.ros.tf2_kdl.tf2_kdl.tf2_kdl import transform_to_kdl as transform_to_kdl
