"""ROS's package four_wheel_steering_controller."""
