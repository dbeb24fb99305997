"""The names of rospy.impl.tcpros_base."""

from minirospy.ros.rospy.rospy.impl.transport import DEFAULT_BUFF_SIZE, TCPROS

__all__ = ["DEFAULT_BUFF_SIZE", "TCPROS"]
