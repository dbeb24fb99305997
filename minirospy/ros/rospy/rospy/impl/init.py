"""rospy.impl.init: the default port of a node."""

from minirospy.client.log_handlers import RosStreamHandler
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["DEFAULT_MASTER_PORT", "DEFAULT_MASTER_URI", "DEFAULT_NODE_PORT", "RosStreamHandler"]

__getattr__ = modules_on_first_use("rospy.impl.init", "logging os rosgraph sys time traceback")

DEFAULT_NODE_PORT = 0  # any free port
DEFAULT_MASTER_PORT = 11311
DEFAULT_MASTER_URI = f"http://localhost:{DEFAULT_MASTER_PORT}/"
