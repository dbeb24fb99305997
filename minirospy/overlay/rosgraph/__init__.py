"""rosgraph, provided by minirospy: the Master API, names and the environment for Python code."""

from minirospy.ros.rosgraph.rosgraph import __getattr__ as __getattr__
from minirospy.ros.rosgraph.rosgraph import myargv
from rosgraph import masterapi as masterapi
from rosgraph import names as names
from rosgraph import network as network
from rosgraph import rosenv as rosenv
from rosgraph.masterapi import Master, MasterError, MasterException, MasterFailure
from rosgraph.masterapi import is_online as is_master_online
from rosgraph.rosenv import ROS_HOSTNAME, ROS_IP, ROS_IPV6, ROS_MASTER_URI, ROS_NAMESPACE, get_master_uri

__all__ = [
    "ROS_HOSTNAME", "ROS_IP", "ROS_IPV6", "ROS_MASTER_URI", "ROS_NAMESPACE", "Master", "MasterError", "MasterException",
    "MasterFailure", "get_master_uri", "is_master_online", "myargv",
]  # fmt: skip
