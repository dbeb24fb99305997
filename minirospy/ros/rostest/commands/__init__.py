"""The commands of the ROS package rostest."""
