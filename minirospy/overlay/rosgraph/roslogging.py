"""rosgraph.roslogging, provided by minirospy: the handler that logging configuration files name and programs derive from."""

from minirospy.client.log_handlers import RosStreamHandler
from minirospy.ros.rosgraph.rosgraph.roslogging import LoggingException, RospyLogger, configure_logging
from minirospy.ros.rosgraph.rosgraph.roslogging import _color_reset as _color_reset
from minirospy.ros.rosgraph.rosgraph.roslogging import _defaultFormatter as _defaultFormatter
from minirospy.ros.rosgraph.rosgraph.roslogging import _logging_to_rospy_names as _logging_to_rospy_names

__all__ = ["LoggingException", "RosStreamHandler", "RospyLogger", "configure_logging"]
