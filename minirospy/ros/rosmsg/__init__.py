"""The ROS package rosmsg."""
