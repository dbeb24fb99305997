"""The commands of the ROS package roswtf."""
