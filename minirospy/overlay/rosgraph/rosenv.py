"""rosgraph.rosenv, provided by minirospy."""

from minirospy.base.environment import DEFAULT_MASTER_PORT
from minirospy.ros.rosgraph.rosgraph.rosenv import (
    DEFAULT_MASTER_URI,
    ROS_HOSTNAME,
    ROS_IP,
    ROS_IPV6,
    ROS_MASTER_URI,
    ROS_NAMESPACE,
    get_master_uri,
)

__all__ = [
    "DEFAULT_MASTER_PORT",
    "DEFAULT_MASTER_URI",
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_IPV6",
    "ROS_MASTER_URI",
    "ROS_NAMESPACE",
    "get_master_uri",
]
