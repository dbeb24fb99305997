"""The ROS package ament_index_python."""
