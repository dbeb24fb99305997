"""The ROS package rosparam."""
