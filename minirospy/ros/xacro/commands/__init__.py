"""The commands of the ROS package xacro."""
