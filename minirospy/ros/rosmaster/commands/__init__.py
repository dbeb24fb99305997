"""The commands of the ROS package rosmaster."""
