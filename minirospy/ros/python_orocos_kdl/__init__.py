"""The ROS package python_orocos_kdl."""
