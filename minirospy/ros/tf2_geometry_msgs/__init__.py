"""The ROS package tf2_geometry_msgs."""
