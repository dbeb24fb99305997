"""The ROS package teleop_twist_joy: Twists from a joystick. Source: http://wiki.ros.org/teleop_twist_joy."""

from minirospy.base.ros1_imports import prefer_ros1

# Its modules import messages of ROS 1, which are not the first of their names if ROS 2 is sourced.
prefer_ros1()
