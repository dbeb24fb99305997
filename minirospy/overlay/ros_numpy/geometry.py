"""ros_numpy.geometry, provided by minirospy. Source: http://wiki.ros.org/ros_numpy."""

from minirospy.ros.ros_numpy.ros_numpy.geometry import (
    numpy_to_point,
    numpy_to_pose,
    numpy_to_quat,
    numpy_to_transform,
    numpy_to_vector3,
    point_to_numpy,
    pose_to_numpy,
    quat_to_numpy,
    transform_to_numpy,
    vector3_to_numpy,
)

__all__ = [
    "numpy_to_point",
    "numpy_to_pose",
    "numpy_to_quat",
    "numpy_to_transform",
    "numpy_to_vector3",
    "point_to_numpy",
    "pose_to_numpy",
    "quat_to_numpy",
    "transform_to_numpy",
    "vector3_to_numpy",
]
