"""sensor_msgs.point_cloud2, provided by minirospy: the points of clouds. Source: http://wiki.ros.org/sensor_msgs."""

from minirospy.ros.sensor_msgs.sensor_msgs.point_cloud2 import (
    _DATATYPES,
    _get_struct_fmt,
    create_cloud,
    create_cloud_xyz32,
    read_points,
    read_points_list,
    read_points_numpy,
)
from sensor_msgs.msg import PointCloud2, PointField

__all__ = [
    "PointCloud2",
    "PointField",
    "create_cloud",
    "create_cloud_xyz32",
    "read_points",
    "read_points_list",
    "read_points_numpy",
]
