"""The commands of the ROS package urdf."""
