"""The ROS package rospkg."""
