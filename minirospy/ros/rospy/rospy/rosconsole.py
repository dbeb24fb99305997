"""rospy.rosconsole: the command rosconsole."""

from minirospy.ros.rosconsole.commands.rosconsole import main
from minirospy.ros.rospy.rospy.logger_level_service_caller import (
    LoggerLevelServiceCaller,
    ROSConsoleException,
)

NAME = "rosconsole"

__all__ = ["NAME", "LoggerLevelServiceCaller", "ROSConsoleException", "main"]
