"""The ROS package dynamic_reconfigure."""
