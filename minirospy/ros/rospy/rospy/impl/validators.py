"""The names of rospy.impl.validators."""

from minirospy.ros.rospy.rospy.names import ParameterInvalid

__all__ = ["ParameterInvalid"]
