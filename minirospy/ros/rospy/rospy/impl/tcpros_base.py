"""rospy.impl.tcpros_base: a TCPROS connection for programs that open connections themselves."""

from minirospy.base.errors import TransportException, TransportInitError, TransportTerminated
from minirospy.client.length_prefix import deserialize_messages, serialize_message
from minirospy.client.tcpros import TCPROSTransport, TCPROSTransportProtocol, recv_buff
from minirospy.ros.rosgraph.rosgraph.network import read_ros_handshake_header, write_ros_handshake_header
from minirospy.ros.rospy.rospy.impl.transport import DEFAULT_BUFF_SIZE, TCPROS

__all__ = [
    "DEFAULT_BUFF_SIZE",
    "TCPROS",
    "TCPROSTransport",
    "TCPROSTransportProtocol",
    "TransportException",
    "TransportInitError",
    "TransportTerminated",
    "deserialize_messages",
    "read_ros_handshake_header",
    "recv_buff",
    "serialize_message",
    "write_ros_handshake_header",
]
