"""The ROS package tf_conversions."""
