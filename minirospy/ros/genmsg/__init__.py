"""The ROS package genmsg."""
