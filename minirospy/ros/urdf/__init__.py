"""The ROS package urdf."""
