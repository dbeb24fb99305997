"""rospy.impl.validators, filled in by minirospy."""

from minirospy.client.naming import ParameterInvalid

__all__ = ["ParameterInvalid"]
