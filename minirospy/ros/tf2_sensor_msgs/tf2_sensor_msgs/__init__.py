"""tf2_sensor_msgs: transforms point clouds for tf2_ros. Importing this package registers the type PointCloud2."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sensor_msgs.msg import PointCloud2

    from minirospy.ros.tf2_sensor_msgs.tf2_sensor_msgs import tf2_sensor_msgs
    from minirospy.ros.tf2_sensor_msgs.tf2_sensor_msgs.tf2_sensor_msgs import (
        do_transform_cloud,
        from_msg_msg,
        to_msg_msg,
        transform_to_kdl,
    )

__all__ = [
    "PointCloud2",
    "do_transform_cloud",
    "from_msg_msg",
    "tf2_sensor_msgs",
    "to_msg_msg",
    "transform_to_kdl",
]
