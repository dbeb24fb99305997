"""The ROS package tf2_ros."""
