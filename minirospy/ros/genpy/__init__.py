"""The ROS package genpy."""
