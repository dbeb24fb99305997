"""tf2_geometry_msgs: transforms points, vectors and poses for tf2_ros. Importing this package registers these types."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from geometry_msgs.msg import PointStamped, PoseStamped, Vector3Stamped, WrenchStamped

    from minirospy.ros.tf2_geometry_msgs.tf2_geometry_msgs import tf2_geometry_msgs
    from minirospy.ros.tf2_geometry_msgs.tf2_geometry_msgs.tf2_geometry_msgs import (
        do_transform_point,
        do_transform_pose,
        do_transform_vector3,
        do_transform_wrench,
        from_msg_msg,
        to_msg_msg,
        transform_to_kdl,
    )

__all__ = [
    "PointStamped",
    "PoseStamped",
    "Vector3Stamped",
    "WrenchStamped",
    "do_transform_point",
    "do_transform_pose",
    "do_transform_vector3",
    "do_transform_wrench",
    "from_msg_msg",
    "tf2_geometry_msgs",
    "to_msg_msg",
    "transform_to_kdl",
]
