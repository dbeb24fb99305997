"""Teleoperation: joysticks and keyboards, and the nodes that convert their input to Twist messages.

Source: http://wiki.ros.org/joy, http://wiki.ros.org/teleop_twist_joy, http://wiki.ros.org/teleop_twist_keyboard.
"""

from minirospy.base.ros1_imports import prefer_ros1

# These modules import ROS 1 messages; if ROS 2 is sourced, its packages of the same names come first.
prefer_ros1()
