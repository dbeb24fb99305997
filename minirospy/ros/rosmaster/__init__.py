"""The ROS package rosmaster."""
