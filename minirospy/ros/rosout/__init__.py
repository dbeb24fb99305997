"""The ROS package rosout."""
