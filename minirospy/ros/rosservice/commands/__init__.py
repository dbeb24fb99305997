"""The commands of the ROS package rosservice."""
