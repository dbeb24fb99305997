"""rospy.rosconsole: the command rosconsole."""

from minirospy.ros.rosconsole.commands.rosconsole import main
from minirospy.ros.rospy.rospy.logger_level_service_caller import (
    LoggerLevelServiceCaller,
    ROSConsoleException,
)
from minirospy.ros.submodules import modules_on_first_use

NAME = "rosconsole"

__all__ = ["NAME", "LoggerLevelServiceCaller", "ROSConsoleException", "main"]

__getattr__ = modules_on_first_use("rospy.rosconsole", "os re rosgraph rospy socket sys")
