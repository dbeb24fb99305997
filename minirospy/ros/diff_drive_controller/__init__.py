"""ROS's package diff_drive_controller."""
