"""The ROS package rosnode."""
