"""The part of `import rospy` besides `minirospy.client`: rospy's submodules, which programs reach into."""
