"""The names of rospy.impl.tcpros_service."""

from minirospy.base.errors import ServiceException
from minirospy.client.services import Service, ServiceProxy, wait_for_service

__all__ = ["Service", "ServiceException", "ServiceProxy", "wait_for_service"]
