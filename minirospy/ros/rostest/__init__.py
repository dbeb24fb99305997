"""The ROS package rostest."""
