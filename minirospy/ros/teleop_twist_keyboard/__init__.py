"""The ROS package teleop_twist_keyboard: converts keys to Twists. Source: http://wiki.ros.org/teleop_twist_keyboard."""

from minirospy.base.ros1_imports import prefer_ros1

# The modules in this package import ROS 1 messages.
# With a sourced ROS 2, Python would otherwise find the ROS 2 packages with the same names first.
prefer_ros1()
