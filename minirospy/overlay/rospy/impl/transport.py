"""rospy.impl.transport, provided by minirospy: the directions of a connection in getBusInfo, and constants of TCPROS."""

from minirospy.ros.rospy.rospy.impl.transport import BIDIRECTIONAL, INBOUND, OUTBOUND
from minirospy.ros.rospy.rospy.impl.transport import __getattr__ as __getattr__

__all__ = ["BIDIRECTIONAL", "INBOUND", "OUTBOUND"]
