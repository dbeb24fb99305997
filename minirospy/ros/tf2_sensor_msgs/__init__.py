"""The ROS package tf2_sensor_msgs."""
