"""The ROS package message_filters."""
