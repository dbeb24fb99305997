"""The ROS package teleop_twist_keyboard."""
