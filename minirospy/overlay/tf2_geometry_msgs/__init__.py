"""tf2_geometry_msgs, provided by minirospy: points, vectors and poses for tf2_ros. Source: http://wiki.ros.org/tf2_geometry_msgs."""

from geometry_msgs.msg import PointStamped as PointStamped
from geometry_msgs.msg import PoseStamped as PoseStamped
from geometry_msgs.msg import Vector3Stamped as Vector3Stamped
from geometry_msgs.msg import WrenchStamped as WrenchStamped

from minirospy.ros.tf2_geometry_msgs.tf2_geometry_msgs.tf2_geometry_msgs import (
    do_transform_point as do_transform_point,
)
from minirospy.ros.tf2_geometry_msgs.tf2_geometry_msgs.tf2_geometry_msgs import (
    do_transform_pose as do_transform_pose,
)
from minirospy.ros.tf2_geometry_msgs.tf2_geometry_msgs.tf2_geometry_msgs import (
    do_transform_vector3 as do_transform_vector3,
)
from minirospy.ros.tf2_geometry_msgs.tf2_geometry_msgs.tf2_geometry_msgs import (
    do_transform_wrench as do_transform_wrench,
)
from minirospy.ros.tf2_geometry_msgs.tf2_geometry_msgs.tf2_geometry_msgs import from_msg_msg as from_msg_msg
from minirospy.ros.tf2_geometry_msgs.tf2_geometry_msgs.tf2_geometry_msgs import to_msg_msg as to_msg_msg
from minirospy.ros.tf2_geometry_msgs.tf2_geometry_msgs.tf2_geometry_msgs import (
    transform_to_kdl as transform_to_kdl,
)
from tf2_geometry_msgs import tf2_geometry_msgs as tf2_geometry_msgs
