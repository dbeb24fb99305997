"""The ROS package angles."""
