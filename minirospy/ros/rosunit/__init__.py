"""The ROS package rosunit."""
