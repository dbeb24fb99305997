"""The submodules of rospy that programs import; the names of `import rospy` itself are in `minirospy.client`."""
