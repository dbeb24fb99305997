"""The ROS package xacro."""
