"""The ROS package topic_tools."""
