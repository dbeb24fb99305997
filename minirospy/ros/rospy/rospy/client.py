"""Provides the names in ROS's module rospy.client."""

from roscpp.msg import Logger
from roscpp.srv import GetLoggers, GetLoggersResponse, SetLoggerLevel, SetLoggerLevelResponse
from rosgraph_msgs.msg import Log

from minirospy.client import (
    DEBUG,
    ERROR,
    FATAL,
    INFO,
    WARN,
    Service,
    delete_param,
    get_param,
    get_param_cached,
    get_param_names,
    get_published_topics,
    has_param,
    init_node,
    load_command_line_node_params,
    logdebug,
    logerr,
    loginfo,
    logwarn,
    myargv,
    on_shutdown,
    search_param,
    set_param,
    spin,
    wait_for_message,
)
from minirospy.client.params import UNSPECIFIED as _unspecified
from minirospy.client.params import Unspecified as _Unspecified
from minirospy.ros.rospy.rospy.msproxy import get_master

__all__ = [
    "DEBUG",
    "ERROR",
    "FATAL",
    "INFO",
    "WARN",
    "GetLoggers",
    "GetLoggersResponse",
    "Log",
    "Logger",
    "Service",
    "SetLoggerLevel",
    "SetLoggerLevelResponse",
    "_Unspecified",
    "_unspecified",
    "delete_param",
    "get_master",
    "get_param",
    "get_param_cached",
    "get_param_names",
    "get_published_topics",
    "has_param",
    "init_node",
    "load_command_line_node_params",
    "logdebug",
    "logerr",
    "loginfo",
    "logwarn",
    "myargv",
    "on_shutdown",
    "search_param",
    "set_param",
    "spin",
    "wait_for_message",
]
