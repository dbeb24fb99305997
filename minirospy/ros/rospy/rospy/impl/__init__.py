"""rospy.impl: the few internal names of rospy that programs use."""
