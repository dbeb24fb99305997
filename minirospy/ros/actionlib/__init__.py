"""The ROS package actionlib."""
