"""ROS's package effort_controllers."""
