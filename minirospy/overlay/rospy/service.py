"""rospy.service, filled in by minirospy."""

from minirospy.client.services import Service, ServiceProxy
from minirospy.errors import ServiceException

__all__ = ["Service", "ServiceException", "ServiceProxy"]
