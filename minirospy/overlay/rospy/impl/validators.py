"""rospy.impl.validators, filled in by minirospy."""

from minirospy.compat.rospy.names import ParameterInvalid

__all__ = ["ParameterInvalid"]
