"""The ROS package rosbash."""
