"""The commands of the ROS package rostopic."""
