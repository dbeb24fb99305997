"""rospy.service, filled in by minirospy."""

from minirospy.client.services import Service, ServiceProxy
from minirospy.errors import ServiceException
from rospy import core as _core
from rospy.core import *  # noqa: F403
from rospy.impl.registration import Registration
from rospy.impl.transport import BIDIRECTIONAL, INBOUND, OUTBOUND

__all__ = [
    "BIDIRECTIONAL",
    "INBOUND",
    "OUTBOUND",
    "Registration",
    "Service",
    "ServiceException",
    "ServiceProxy",
]
__all__ += _core.__all__
