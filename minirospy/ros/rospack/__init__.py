"""The ROS package rospack."""
