"""The ROS package controller_manager_msgs."""
