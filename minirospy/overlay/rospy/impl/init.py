"""rospy.impl.init, provided by minirospy."""

from minirospy.client.log_handlers import RosStreamHandler
from minirospy.ros.rospy.rospy.impl.init import DEFAULT_MASTER_PORT, DEFAULT_MASTER_URI, DEFAULT_NODE_PORT

__all__ = ["DEFAULT_MASTER_PORT", "DEFAULT_MASTER_URI", "DEFAULT_NODE_PORT", "RosStreamHandler"]
