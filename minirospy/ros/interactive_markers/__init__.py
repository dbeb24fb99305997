"""The ROS package interactive_markers."""
