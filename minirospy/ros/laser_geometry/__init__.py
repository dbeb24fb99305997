"""The ROS package laser_geometry."""
