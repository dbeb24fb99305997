"""rospy.impl.validators, provided by minirospy."""

from minirospy.compat.rospy.names import ParameterInvalid

__all__ = ["ParameterInvalid"]
