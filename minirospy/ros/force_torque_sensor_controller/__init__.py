"""ROS's package force_torque_sensor_controller."""
