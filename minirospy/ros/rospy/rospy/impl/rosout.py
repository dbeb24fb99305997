"""rospy.impl.rosout: the handler that publishes log records, and the numeric levels."""

from minirospy.base.log_levels import PYTHON_LEVELS
from minirospy.client.log_handlers import RosOutHandler

__all__ = ["RosOutHandler", "_logging_to_rospy_levels", "_rospy_to_logging_levels"]

_rospy_to_logging_levels = PYTHON_LEVELS
_logging_to_rospy_levels = {python: ros for ros, python in PYTHON_LEVELS.items()}
