"""Connects microcontrollers to ROS over a serial port or TCP.

Source: http://wiki.ros.org/rosserial, http://wiki.ros.org/rosserial_python.
"""

from minirospy.base.ros1_imports import prefer_ros1

# This package's modules import ROS 1 messages.
# If ROS 2 is sourced, the ROS 2 packages with the same names would be found first.
prefer_ros1()
