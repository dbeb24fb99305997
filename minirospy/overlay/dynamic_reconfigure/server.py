"""dynamic_reconfigure.server, provided by minirospy. Source: http://wiki.ros.org/dynamic_reconfigure."""

from dynamic_reconfigure.msg import Config as ConfigMsg
from dynamic_reconfigure.msg import ConfigDescription as ConfigDescrMsg
from dynamic_reconfigure.srv import Reconfigure as ReconfigureSrv
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.server import Server

__all__ = [
    "ConfigDescrMsg",
    "ConfigMsg",
    "ReconfigureSrv",
    "Server",
]
