"""The ROS package rosserial_python."""
