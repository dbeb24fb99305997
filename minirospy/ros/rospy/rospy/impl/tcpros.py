"""rospy.impl.tcpros: TCPROS constants."""

from minirospy.ros.rospy.rospy.impl.transport import DEFAULT_BUFF_SIZE

__all__ = ["DEFAULT_BUFF_SIZE"]
