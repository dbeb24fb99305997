"""The ROS package rosdep."""
