"""rospy.impl.tcpros_base, filled in by minirospy."""

__all__ = ["DEFAULT_BUFF_SIZE", "TCPROS"]

DEFAULT_BUFF_SIZE = 65536
"""The default of Subscriber's ``buff_size``."""
TCPROS = "TCPROS"
