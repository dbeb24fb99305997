"""rospkg.common, provided by minirospy: file names, and the error of a name that is not found."""

from minirospy.ros.rospkg.rospkg.common import (
    MANIFEST_FILE,
    PACKAGE_FILE,
    ROS_STACK,
    STACK_FILE,
    ResourceNotFound,
)

__all__ = ["MANIFEST_FILE", "PACKAGE_FILE", "ROS_STACK", "STACK_FILE", "ResourceNotFound"]
