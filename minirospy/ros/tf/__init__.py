"""The ROS package tf."""
