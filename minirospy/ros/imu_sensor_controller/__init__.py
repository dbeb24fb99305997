"""ROS's package imu_sensor_controller."""
