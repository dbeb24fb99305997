"""The ROS package rosservice."""
