"""The ROS package rospy."""
