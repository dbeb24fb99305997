"""The commands of the ROS package rosparam."""
