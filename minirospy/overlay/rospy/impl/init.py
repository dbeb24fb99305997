"""rospy.impl.init, provided by minirospy."""

from minirospy.client.log_handlers import RosStreamHandler
from minirospy.compat.rospy.impl.init import DEFAULT_MASTER_PORT, DEFAULT_MASTER_URI, DEFAULT_NODE_PORT

__all__ = ["DEFAULT_MASTER_PORT", "DEFAULT_MASTER_URI", "DEFAULT_NODE_PORT", "RosStreamHandler"]
