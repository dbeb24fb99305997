"""The names of rospy.impl.tcpros_base."""

from minirospy.ros.rospy.rospy.impl.transport import DEFAULT_BUFF_SIZE, TCPROS
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["DEFAULT_BUFF_SIZE", "TCPROS"]

__getattr__ = modules_on_first_use(
    "rospy.impl.tcpros_base",
    "atexit errno functools inspect logging os pickle rosgraph rospkg rospy select signal socket "
    "struct sys threading time traceback types urlparse=urllib.parse warnings "
    "xmlrpcclient=xmlrpc.client",
)
