"""The ROS package ros_numpy."""
