"""The ROS package rosbag."""
