"""The ROS package catkin."""
