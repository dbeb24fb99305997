"""The ROS package rosversion."""
