"""The rospy API: thin blocking twins over `minirospy.runtime`; what `import rospy` re-exports."""
