"""Connects microcontrollers to ROS over a serial port or TCP.

Source: http://wiki.ros.org/rosserial, http://wiki.ros.org/rosserial_python.
"""

from minirospy.base.ros1_imports import prefer_ros1

# The modules below import messages of ROS 1; if ROS 2 is sourced, its packages of the same names would come first.
prefer_ros1()
