"""The ROS package rospy_message_converter."""
