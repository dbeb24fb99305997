"""rospy.impl.transport, filled in by minirospy: the directions of a connection, as getBusInfo tells them."""

from minirospy.compat.rospy.impl.transport import BIDIRECTIONAL, INBOUND, OUTBOUND
from minirospy.compat.rospy.impl.transport import __getattr__ as __getattr__

__all__ = ["BIDIRECTIONAL", "INBOUND", "OUTBOUND"]
