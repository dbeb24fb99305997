"""The commands of the ROS package rosversion."""
