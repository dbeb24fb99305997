"""dynamic_reconfigure.client, provided by minirospy. Source: http://wiki.ros.org/dynamic_reconfigure."""

from dynamic_reconfigure.msg import Config as ConfigMsg
from dynamic_reconfigure.msg import ConfigDescription as ConfigDescrMsg
from dynamic_reconfigure.srv import Reconfigure as ReconfigureSrv
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.client import Client

__all__ = [
    "Client",
    "ConfigDescrMsg",
    "ConfigMsg",
    "ReconfigureSrv",
]
