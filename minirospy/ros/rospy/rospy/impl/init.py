"""rospy.impl.init."""

from minirospy.client.log_handlers import RosStreamHandler

__all__ = ["DEFAULT_MASTER_PORT", "DEFAULT_MASTER_URI", "DEFAULT_NODE_PORT", "RosStreamHandler"]

DEFAULT_NODE_PORT = 0  # any free port
DEFAULT_MASTER_PORT = 11311
DEFAULT_MASTER_URI = f"http://localhost:{DEFAULT_MASTER_PORT}/"
