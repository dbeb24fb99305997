"""Provides the names in ROS's module rospy.impl.validators."""

from minirospy.ros.rospy.rospy.names import ParameterInvalid

__all__ = ["ParameterInvalid"]
