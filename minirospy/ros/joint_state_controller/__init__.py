"""ROS's package joint_state_controller."""
