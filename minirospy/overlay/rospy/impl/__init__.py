"""rospy.impl, provided by minirospy."""

from minirospy.ros.rospy.rospy.impl import __getattr__ as __getattr__
