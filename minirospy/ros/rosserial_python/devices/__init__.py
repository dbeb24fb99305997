"""Connects microcontrollers to ROS over a serial port or TCP.

Source: http://wiki.ros.org/rosserial, http://wiki.ros.org/rosserial_python.
"""

from minirospy.base.ros1_imports import prefer_ros1

# This package's modules import ROS 1 messages.
# In a shell with ROS 2 sourced, ``import`` would otherwise find ROS 2's packages of the same names.
prefer_ros1()
