"""tf2_kdl: transforms PyKDL's types for tf2_ros. Importing this package registers these types."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from geometry_msgs.msg import PointStamped

    from minirospy.ros.tf2_kdl.tf2_kdl import tf2_kdl
    from minirospy.ros.tf2_kdl.tf2_kdl.tf2_kdl import (
        convert_vector,
        do_transform_frame,
        do_transform_twist,
        do_transform_vector,
        do_transform_wrench,
        from_msg_vector,
        to_msg_vector,
        transform_to_kdl,
    )

__all__ = [
    "PointStamped",
    "convert_vector",
    "do_transform_frame",
    "do_transform_twist",
    "do_transform_vector",
    "do_transform_wrench",
    "from_msg_vector",
    "tf2_kdl",
    "to_msg_vector",
    "transform_to_kdl",
]
