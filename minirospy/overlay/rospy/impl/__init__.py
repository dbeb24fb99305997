"""rospy.impl, provided by minirospy."""

from minirospy.compat.rospy.impl import __getattr__ as __getattr__
