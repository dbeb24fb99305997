"""rospy.impl.transport, filled in by minirospy: the directions of a connection, as getBusInfo tells them."""

__all__ = ["BIDIRECTIONAL", "INBOUND", "OUTBOUND"]

INBOUND, OUTBOUND, BIDIRECTIONAL = "i", "o", "b"
