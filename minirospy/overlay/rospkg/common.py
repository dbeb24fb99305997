"""rospkg.common, filled in by minirospy."""

from minirospy.workspace.rospkg import MANIFEST_FILE, PACKAGE_FILE, STACK_FILE, ResourceNotFound

__all__ = ["MANIFEST_FILE", "PACKAGE_FILE", "ROS_STACK", "STACK_FILE", "ResourceNotFound"]

ROS_STACK = "ros"
