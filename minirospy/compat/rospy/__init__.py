"""What `import rospy` offers in addition to `minirospy.client`: rospy's submodules, which programs reach into."""
