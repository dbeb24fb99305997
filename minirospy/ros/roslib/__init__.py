"""The ROS package roslib."""
