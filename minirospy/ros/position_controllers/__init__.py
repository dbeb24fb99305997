"""ROS's package position_controllers."""
