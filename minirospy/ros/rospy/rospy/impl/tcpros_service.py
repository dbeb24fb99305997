"""The names of rospy.impl.tcpros_service."""

from minirospy.base.errors import ServiceException
from minirospy.client.services import Service, ServiceProxy, wait_for_service
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["Service", "ServiceException", "ServiceProxy", "wait_for_service"]

__getattr__ = modules_on_first_use(
    "rospy.impl.tcpros_service",
    "genpy io logging rosgraph rospy socket struct sys threading time traceback",
)
