"""ROS's package velocity_controllers."""
