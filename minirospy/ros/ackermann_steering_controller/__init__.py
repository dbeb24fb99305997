"""ROS's package ackermann_steering_controller."""
