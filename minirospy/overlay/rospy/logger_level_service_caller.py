"""rospy.logger_level_service_caller, provided by minirospy: the levels of other nodes' loggers."""

import rosservice as rosservice

import rospy as rospy
from minirospy.ros.rospy.rospy.logger_level_service_caller import (
    LoggerLevelServiceCaller,
    ROSConsoleException,
)

__all__ = ["LoggerLevelServiceCaller", "ROSConsoleException"]
