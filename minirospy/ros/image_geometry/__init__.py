"""The ROS package image_geometry."""
