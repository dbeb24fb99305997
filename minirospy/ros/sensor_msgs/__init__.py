"""The ROS package sensor_msgs."""
