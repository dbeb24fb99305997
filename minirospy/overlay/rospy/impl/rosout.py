"""rospy.impl.rosout, provided by minirospy: the handler that publishes log records, and the levels' numbers."""

from minirospy.client.log_handlers import RosOutHandler
from minirospy.ros.rospy.rospy.impl.rosout import _logging_to_rospy_levels as _logging_to_rospy_levels
from minirospy.ros.rospy.rospy.impl.rosout import _rospy_to_logging_levels as _rospy_to_logging_levels

__all__ = ["RosOutHandler"]
