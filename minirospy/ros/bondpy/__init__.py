"""The ROS package bondpy."""
