"""The ROS package rosauth."""
