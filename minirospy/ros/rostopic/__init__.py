"""The ROS package rostopic."""
