"""Provides the names in ROS's module rospy.impl.paramserver."""

from minirospy.client.params import KeptParameters as ParamServerCache
from minirospy.client.params import get_param_server_cache

__all__ = ["ParamServerCache", "get_param_server_cache"]
