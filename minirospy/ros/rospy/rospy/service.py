"""Provides the names in ROS's module rospy.service."""

from minirospy.base.errors import ServiceException
from minirospy.client.service import Service
from minirospy.client.service_proxy import ServiceProxy
from minirospy.ros.rospy.rospy.core import service_logger as logger
from minirospy.ros.rospy.rospy.impl.registration import Registration, ServiceManager
from minirospy.ros.rospy.rospy.impl.transport import BIDIRECTIONAL, INBOUND, OUTBOUND

__all__ = [
    "BIDIRECTIONAL",
    "INBOUND",
    "OUTBOUND",
    "Registration",
    "Service",
    "ServiceException",
    "ServiceManager",
    "ServiceProxy",
    "logger",
]
