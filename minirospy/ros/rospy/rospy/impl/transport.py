"""rospy.impl.transport and tcpros_base: the connection directions in getBusInfo, and TCPROS constants."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.client.tcpros import DeadTransport, ProtocolHandler, Transport

__all__ = ["BIDIRECTIONAL", "INBOUND", "OUTBOUND", "DeadTransport", "ProtocolHandler", "Transport"]

INBOUND, OUTBOUND, BIDIRECTIONAL = "i", "o", "b"
TCPROS = "TCPROS"
DEFAULT_BUFF_SIZE = 65536
"""The default value for Subscriber's ``buff_size``."""
