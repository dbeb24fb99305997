"""The ROS package rosclean."""
