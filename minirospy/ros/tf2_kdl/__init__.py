"""The ROS package tf2_kdl."""
