"""Hands to velocities: joysticks, keys, and what makes Twists of them.

Source: http://wiki.ros.org/joy, http://wiki.ros.org/teleop_twist_joy, http://wiki.ros.org/teleop_twist_keyboard.
"""

from minirospy.base.ros1_imports import prefer_ros1

# Its modules import messages of ROS 1, which are not the first of their names where ROS 2 is sourced.
prefer_ros1()
