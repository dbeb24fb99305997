"""rospy.logger_level_service_caller, filled in by minirospy: the levels of other nodes' loggers.

Source: the behaviour of rospy's class, which rqt_logger_level and programs that make a noisy node quiet use.
"""

import rosservice as rosservice

import rospy as rospy
from minirospy.compat.rospy.logger_level_service_caller import LoggerLevelServiceCaller, ROSConsoleException

__all__ = ["LoggerLevelServiceCaller", "ROSConsoleException"]
