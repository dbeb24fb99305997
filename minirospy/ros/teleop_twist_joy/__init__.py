"""The ROS package teleop_twist_joy: converts joystick states to Twists. Source: http://wiki.ros.org/teleop_twist_joy."""

from minirospy.base.ros1_imports import prefer_ros1

# The modules in this package import ROS 1 messages.
# Otherwise, if ROS 2 is sourced, Python would first find the ROS 2 message packages with the same names.
prefer_ros1()
