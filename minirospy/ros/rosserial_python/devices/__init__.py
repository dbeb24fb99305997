"""Connects microcontrollers to ROS over a serial port or TCP.

Source: http://wiki.ros.org/rosserial, http://wiki.ros.org/rosserial_python.
"""

from minirospy.base.ros1_imports import prefer_ros1

# This package's modules import ROS 1 messages.
# If ROS 2 is sourced, Python would otherwise find the ROS 2 packages with the same names.
prefer_ros1()
