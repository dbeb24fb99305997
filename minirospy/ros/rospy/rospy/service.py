"""Provides the names in ROS's module rospy.service."""

from minirospy.base.errors import ServiceException
from minirospy.client.services import Service, ServiceProxy
from minirospy.ros.rospy.rospy.core import service_logger as logger
from minirospy.ros.rospy.rospy.impl.registration import Registration, ServiceManager
from minirospy.ros.rospy.rospy.impl.transport import BIDIRECTIONAL, INBOUND, OUTBOUND
from minirospy.ros.rospy.rospy.passing import service_dir as __dir__
from minirospy.ros.rospy.rospy.passing import service_getattr as __getattr__

__all__ = [
    "BIDIRECTIONAL",
    "INBOUND",
    "OUTBOUND",
    "Registration",
    "Service",
    "ServiceException",
    "ServiceManager",
    "ServiceProxy",
    "__dir__",
    "__getattr__",
    "logger",
]
