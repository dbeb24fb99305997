"""roslib.stacks, provided by minirospy: the stacks of rosbuild."""

from minirospy.ros.roslib.roslib.packages import ROS_PACKAGE_PATH, ROS_ROOT
from minirospy.ros.roslib.roslib.stacks import (
    ROS_STACK,
    InvalidROSStackException,
    ROSStackException,
    expand_to_packages,
    get_stack_dir,
    get_stack_version,
    list_stacks,
    list_stacks_by_path,
    stack_of,
)
from minirospy.ros.rospkg.rospkg.common import STACK_FILE

__all__ = [
    "ROS_PACKAGE_PATH",
    "ROS_ROOT",
    "ROS_STACK",
    "STACK_FILE",
    "InvalidROSStackException",
    "ROSStackException",
    "expand_to_packages",
    "get_stack_dir",
    "get_stack_version",
    "list_stacks",
    "list_stacks_by_path",
    "stack_of",
]
