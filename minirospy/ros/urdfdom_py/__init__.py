"""The ROS package urdfdom_py."""
