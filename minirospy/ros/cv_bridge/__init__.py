"""The ROS package cv_bridge."""
