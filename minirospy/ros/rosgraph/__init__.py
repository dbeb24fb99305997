"""The ROS package rosgraph."""
