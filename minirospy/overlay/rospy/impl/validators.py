"""rospy.impl.validators, provided by minirospy."""

from minirospy.ros.rospy.rospy.names import ParameterInvalid

__all__ = ["ParameterInvalid"]
