"""The ROS package teleop_twist_joy: Twists from a joystick. Source: http://wiki.ros.org/teleop_twist_joy."""

from minirospy.base.ros1_imports import prefer_ros1

# Its modules import ROS 1 messages, and if ROS 2 is sourced, its packages of the same names would be imported
# instead.
prefer_ros1()
