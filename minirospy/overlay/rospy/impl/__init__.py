"""rospy.impl, filled in by minirospy: the few internal names of rospy that programs use."""

from minirospy.compat.rospy.impl import __getattr__ as __getattr__
