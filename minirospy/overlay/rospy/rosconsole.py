"""rospy.rosconsole, provided by minirospy: the command rosconsole."""

from minirospy.ros.rosconsole.commands.rosconsole import main
from minirospy.ros.rospy.rospy.rosconsole import NAME
from rospy.logger_level_service_caller import LoggerLevelServiceCaller, ROSConsoleException

__all__ = ["NAME", "LoggerLevelServiceCaller", "ROSConsoleException", "main"]
