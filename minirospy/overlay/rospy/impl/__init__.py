"""rospy.impl, filled in by minirospy: the few names of rospy's inside that programs reach for."""
