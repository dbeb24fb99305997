"""rospy.impl.tcpros_service, provided by minirospy."""

from minirospy.client.services import Service, ServiceProxy, wait_for_service
from minirospy.errors import ServiceException

__all__ = ["Service", "ServiceException", "ServiceProxy", "wait_for_service"]
