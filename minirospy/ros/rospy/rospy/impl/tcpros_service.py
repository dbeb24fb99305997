"""rospy.impl.tcpros_service: services, and the client and server of a service connection."""

from minirospy.base.errors import (
    ROSException,
    ServiceException,
    TransportInitError,
    TransportTerminated,
)
from minirospy.client.lifecycle import ROSInterruptException
from minirospy.client.service import Service
from minirospy.client.service_proxy import ServiceProxy, wait_for_service
from minirospy.client.tcpros import (
    TCPROSServiceClient,
    TCPROSTransport,
    TCPROSTransportProtocol,
    TCPService,
    recv_buff,
)
from minirospy.core.idl.protocols import Message
from minirospy.core.idl.service import to_response
from minirospy.ros.rospy.rospy.impl.registration import get_service_manager
from minirospy.ros.rospy.rospy.impl.transport import DEFAULT_BUFF_SIZE

__all__ = [
    "DEFAULT_BUFF_SIZE",
    "ROSException",
    "ROSInterruptException",
    "Service",
    "ServiceException",
    "ServiceImpl",
    "ServiceProxy",
    "TCPROSServiceClient",
    "TCPROSTransport",
    "TCPROSTransportProtocol",
    "TCPService",
    "TransportInitError",
    "TransportTerminated",
    "convert_return_to_response",
    "get_service_manager",
    "recv_buff",
    "wait_for_service",
]

ServiceImpl = Service  # the base class of Service in ROS


def convert_return_to_response(response: object, response_class: type[Message]) -> Message:
    """Convert a handler's return value to a response. Raise ServiceException if it does not match the response type."""
    return to_response(response_class, response)
