"""The commands of the ROS package rospack."""
