"""The ROS package roswtf."""
