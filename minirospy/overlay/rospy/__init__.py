"""rospy: filled in by minirospy."""
