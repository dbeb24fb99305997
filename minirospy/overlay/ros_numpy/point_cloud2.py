"""ros_numpy.point_cloud2, provided by minirospy. Source: http://wiki.ros.org/ros_numpy."""

from minirospy.ros.ros_numpy.ros_numpy.point_cloud2 import (
    array_to_pointcloud2,
    dtype_to_fields,
    fields_to_dtype,
    get_xyz_points,
    merge_rgb_fields,
    pointcloud2_to_array,
    pointcloud2_to_xyz_array,
    split_rgb_field,
)

__all__ = [
    "array_to_pointcloud2",
    "dtype_to_fields",
    "fields_to_dtype",
    "get_xyz_points",
    "merge_rgb_fields",
    "pointcloud2_to_array",
    "pointcloud2_to_xyz_array",
    "split_rgb_field",
]
