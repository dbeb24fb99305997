"""The commands of the ROS package rosmsg."""
