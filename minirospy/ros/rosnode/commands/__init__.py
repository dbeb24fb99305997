"""The commands of the ROS package rosnode."""
