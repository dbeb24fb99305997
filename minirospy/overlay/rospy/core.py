"""rospy.core, filled in by minirospy."""

from logging import NullHandler

from rosgraph_msgs.msg import Log

from minirospy.client import get_node_uri, is_shutdown, signal_shutdown
from minirospy.client.core import (
    add_client_shutdown_hook,
    add_preshutdown_hook,
    add_shutdown_hook,
    get_ros_root,
    is_initialized,
    is_shutdown_requested,
    is_topic,
    parse_rosrpc_uri,
    register_signals,
    rospydebug,
    rospyerr,
    rospyinfo,
    rospywarn,
)
from minirospy.client.log import (
    logdebug,
    logdebug_once,
    logdebug_throttle,
    logdebug_throttle_identical,
    logerr,
    logerr_once,
    logerr_throttle,
    logerr_throttle_identical,
    logfatal,
    logfatal_once,
    logfatal_throttle,
    logfatal_throttle_identical,
    loginfo,
    loginfo_once,
    loginfo_throttle,
    loginfo_throttle_identical,
    logout,
    logwarn,
    logwarn_once,
    logwarn_throttle,
    logwarn_throttle_identical,
)
from minirospy.client.msproxy import xmlrpcapi
from rospy import names as _names
from rospy.names import *  # noqa: F403

MASTER_NAME = "master"
ROSRPC = "rosrpc://"
logerror = logerr

__all__ = [
    "MASTER_NAME",
    "ROSRPC",
    "Log",
    "NullHandler",
    "add_client_shutdown_hook",
    "add_preshutdown_hook",
    "add_shutdown_hook",
    "get_node_uri",
    "get_ros_root",
    "is_initialized",
    "is_shutdown",
    "is_shutdown_requested",
    "is_topic",
    "logdebug",
    "logdebug_once",
    "logdebug_throttle",
    "logdebug_throttle_identical",
    "logerr",
    "logerr_once",
    "logerr_throttle",
    "logerr_throttle_identical",
    "logerror",
    "logfatal",
    "logfatal_once",
    "logfatal_throttle",
    "logfatal_throttle_identical",
    "loginfo",
    "loginfo_once",
    "loginfo_throttle",
    "loginfo_throttle_identical",
    "logout",
    "logwarn",
    "logwarn_once",
    "logwarn_throttle",
    "logwarn_throttle_identical",
    "parse_rosrpc_uri",
    "register_signals",
    "rospydebug",
    "rospyerr",
    "rospyinfo",
    "rospywarn",
    "signal_shutdown",
    "xmlrpcapi",
]  # fmt: skip
__all__ += _names.__all__
