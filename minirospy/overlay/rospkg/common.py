"""rospkg.common, filled in by minirospy."""

from minirospy.compat.rospkg.common import (
    MANIFEST_FILE,
    PACKAGE_FILE,
    ROS_STACK,
    STACK_FILE,
    ResourceNotFound,
)

__all__ = ["MANIFEST_FILE", "PACKAGE_FILE", "ROS_STACK", "STACK_FILE", "ResourceNotFound"]
